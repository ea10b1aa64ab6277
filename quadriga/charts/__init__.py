"""Charts of curves and bars, drawn by matplotlib into PNG files and into pages as SVG."""
