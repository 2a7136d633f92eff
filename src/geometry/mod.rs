//! Meshes and what can be computed on them. Pure functions: nothing here knows of scenes, the store or GPUs.
//!
//! Long computations take a [`Tick`](crate::problem::Tick), use every core, and give the same bits on any number of
//! them: threads share the work by items, and every sum runs in a fixed order.

pub mod bvh;
pub mod clearance;
pub mod deform;
pub mod depth_map;
pub mod mesh;
pub mod nearest;
pub mod neighbours;
pub mod normals;
pub mod obj;
pub mod plane_fit;
mod polygon;
pub mod sculpture;
pub mod shapes;
pub mod tangents;
pub mod thickness;
pub mod visibility;
