#![doc = include_str!("../README.md")]

pub mod cpu;

pub use gpu_primitives::wgpu;
