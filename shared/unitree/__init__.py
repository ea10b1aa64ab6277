"""What Unitree's robots speak: packets of the A1 and the Go1 over UDP, and of the Go2 over DDS."""
