//! Diaphane renders translucent things from text files, and says what each way of rendering them costs.
//!
//! # The sentence
//!
//! **Every value is named by the content hash of everything that made it; ask for the image by name, and what is not there
//! yet gets made.**
//!
//! | what the user sees | what it is |
//! |---|---|
//! | bake cache | the name is already in the store (memory, then disk) |
//! | an edit shows | look at the files again, plan again, ask again; only names downstream of the edit are new |
//! | skip what the scene does not need | nobody asked for that name, so it was never made |
//! | undo is instant | the old value still stands under its old name |
//!
//! There are no dirty flags, no invalidation, and no second way for "again". A plan is made anew for every picture.
//!
//! # The flow
//!
//! ```text
//! scenes/*.ron ──┐ files            Scene, Look           Plan                    Store
//! materials/*.ron├─────► read ──────────► render::plan ─────────► get(image) ─────────► Image
//! meshes, images ┤ (bytes, Key)   │                     (a plain list of steps,   (runs what is missing)
//! shaders/*.wgsl ┘                └► Problem            made without a device)
//! ```
//!
//! No arrow goes back; problems leave sideways. Bytes enter through one door, [`store::Files`], which names them by hash.
//! Start reading at `line` in [`render`].
//!
//! # The rooms
//!
//! Each room uses only rooms above it, its tests aside; `tests/tidy.rs` holds that order.
//!
//! | room | what it is | its values are made again when |
//! |---|---|---|
//! | [`problem`] | the only error that a user sees: where, what, what to do | |
//! | [`image`] | linear images; EXR, PNG, HDR, JPEG in, EXR and PNG out; tone curves | |
//! | [`metric`] | how far an image is from a reference: relMSE, DSSIM, FLIP, bias, z-test; heat maps | |
//! | [`papers`] | the bibliography; comments cite its keys | |
//! | [`optics`] | media, Fresnel, gloss, phase functions, profiles, albedo of a half space: scalar f64, mm | |
//! | [`geometry`] | meshes, shapes, sculptures, rays; thickness, planes and filters on vertices | |
//! | [`store`] | the one mechanism: keys, plans, memory, disk, the door for files and who follows them | its key is new |
//! | [`scene`] | RON into a valid [`scene::Scene`]; the only room that knows RON | a file's content changes |
//! | [`reference`] | the truth: light followed on the CPU, in f64; needs no device | anything that light could meet changes |
//! | [`gpu`] | a small vocabulary over wgpu: checked shaders, passes as values | shader, input or size change |
//! | [`frame`] | what a technique is given, and what follows it | see its own table |
//! | [`techniques`] | one folder = one paper's way, with its manual | their bakes: shape, medium or kernel change |
//! | [`render`] | the straight line from scene to image | |
//! | [`session`] | what a command holds while it works | |
//! | [`bench`] | time against error, for techniques × settings | scene, technique or code change |
//! | `preview` | the window; a feature of the build | a hand, a file or the worker moves |
//! | [`commands`] | the words of the command line | |
//!
//! # What always holds
//!
//! - If you hold a [`scene::Scene`], it is valid. Scenes hold physics; a [`render::Look`] holds method: any scene renders
//!   with any technique.
//! - A step's key is its name, its parameters, the keys of what it reads and, for what is kept on disk, the text of the code
//!   that computes it. A step can read only the slots that are its fields.
//! - A *bake* makes bytes and is kept on disk; a *pass* makes textures or buffers and is kept in memory. Nothing else
//!   differs.
//! - What is switched off is absent from the plan, never a dummy.
//! - Nothing that is hashed or printed comes out of a hash map's order.
//! - What a picture shows is scattered + glossy + unscattered light, and a technique makes only the first.
//!
//! # Deliberately absent
//!
//! Materials as node graphs, a scene graph, far and near planes, shadow settings, tangent lengths in pixels: whatever an
//! artist would have to tune per scene and the program can know.

pub mod bench;
pub mod commands;
pub mod frame;
pub mod geometry;
pub mod gpu;
pub mod image;
pub mod metric;
pub mod optics;
pub mod papers;
#[cfg(feature = "preview")]
pub mod preview;
pub mod problem;
pub mod reference;
pub mod render;
pub mod scene;
pub mod session;
pub mod store;
pub mod techniques;
