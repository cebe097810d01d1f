"""The descriptor to which dmplay prints, which is known without importing anything else."""

STDOUT_DESCRIPTORS: list[int] = []  # those of standard output so far, that of today last
