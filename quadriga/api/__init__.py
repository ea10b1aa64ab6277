"""What a script of one's own calls; `import quadriga` has all of it by name."""
