"""Reports as self-contained HTML files: simulated drive, located drive, bound, designs, study."""
