"""A network that loses, delays and damages packets, between processes of one machine."""
