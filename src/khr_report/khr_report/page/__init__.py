"""Pages: one file each, that opens from a disk without a network."""
