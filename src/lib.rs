pub mod geometry;
pub mod gpu;
pub mod image;
pub mod optics;
pub mod papers;
pub mod problem;
pub mod store;
