//! How long a plan takes: it is made anew for every frame, so it must cost well under a millisecond.
//!
//! `cargo bench --bench plan`. The scene has every kind of light and thing: over 80 steps, one of them with 96 views.

use criterion::{Criterion, criterion_group, criterion_main};
use diaphane::gpu::Shaders;
use diaphane::render::{self, Look};
use diaphane::scene::Reader;
use diaphane::store::Store;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

fn plans(criterion: &mut Criterion) {
    for name in ["dark", "sky", "all"] {
        let path = format!("tests/scenes/{name}.scene.ron");
        let (scene, _) = Reader::new(Arc::default()).scene(Path::new(&path), &[]).expect("the scene is valid");
        let (look, shaders, store) = (Look::of(&scene), Shaders::new(None, Arc::default()), Store::in_memory());
        let steps = render::plan(&scene, &look, &shaders).expect("the scene can be planned").0.steps().len();
        criterion.bench_function(&format!("{name}, {steps} steps: made and looked up"), |bencher| {
            bencher.iter(|| {
                let (plan, picture) = render::plan(black_box(&scene), &look, &shaders).expect("it was planned above");
                store.states(&plan, picture)
            });
        });
    }
}

criterion_group!(benches, plans);
criterion_main!(benches);
