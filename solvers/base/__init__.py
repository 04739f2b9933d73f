"""What all rooms stand on: kernels kept on disk, late imports, threads. Nothing of mechanics."""
