pub mod geometry;
pub mod image;
pub mod optics;
pub mod papers;
pub mod problem;
pub mod scene;
pub mod store;
