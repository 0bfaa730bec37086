//! The filler on the CPU: the same steps as the kernels', dense, for tests and for making training data.
