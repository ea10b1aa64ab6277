"""A recorded walk once more, changed from a moment on: what would have happened?"""
