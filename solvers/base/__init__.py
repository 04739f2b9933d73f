"""What all rooms stand on: kernels kept on disk, late imports, threads, memory. Nothing of mechanics."""
