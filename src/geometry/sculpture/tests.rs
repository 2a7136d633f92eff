use super::*;
use crate::geometry::mesh::Topology;

const FIGURES: [Figure; 2] = [Figure::Hare, Figure::Bust];

/// A third of the default, to stay quick in a debug build.
const DETAIL: u32 = 64;

fn smallest_angles(mesh: &Mesh) -> Vec<f64> {
    let smallest = |t| {
        let p: [DVec3; 3] = mesh.corners(t);
        let angle = |i: usize| (p[(i + 1) % 3] - p[i]).angle_between(p[(i + 2) % 3] - p[i]).to_degrees();
        angle(0).min(angle(1)).min(angle(2))
    };
    (0..mesh.triangles.len()).map(smallest).collect()
}

#[test]
fn figures_are_solids_of_one_piece_and_stand_where_they_are_put() {
    for figure in FIGURES {
        let mesh = sculpture(figure, 12.0, DETAIL);
        assert!(mesh.is_closed());
        let Topology { components, open_edges, irregular_edges, .. } = mesh.topology();
        assert_eq!((components, open_edges, irregular_edges), (1, 0, 0));
        assert!(mesh.signed_volume() > 0.0);
        let (min, size, center) = (mesh.bounds().min, mesh.bounds().size(), mesh.bounds().center());
        assert!(min.y.abs() < 1e-5 && (size.y - 12.0).abs() < 1e-4);
        assert!(center.x.abs() < 1e-5 && center.z.abs() < 1e-5);
    }
}

#[test]
fn triangles_are_even_and_normals_are_those_of_the_surface() {
    for figure in FIGURES {
        let mesh = sculpture(figure, 1.0, DETAIL);
        let angles = smallest_angles(&mesh);
        assert!(angles.iter().filter(|angle| **angle < 5.0).count() * 1000 <= angles.len());
        assert!(angles.iter().sum::<f64>() / angles.len() as f64 > 45.0);
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        let agree = mesh.normals.iter().zip(mesh.smooth_normals()).filter(|(a, b)| a.dot(*b) > 0.8).count();
        assert!(agree * 100 > 96 * mesh.normals.len(), "{agree} of {}", mesh.normals.len());
    }
}

#[test]
fn detail_refines_without_changing_the_shape() {
    for figure in FIGURES {
        let [coarse, fine] = [DETAIL, 2 * DETAIL].map(|detail| sculpture(figure, 1.0, detail));
        let growth = fine.triangles.len() as f64 / coarse.triangles.len() as f64;
        assert!(growth > 3.0 && growth < 5.0, "{growth}");
        assert!((fine.signed_volume() / coarse.signed_volume() - 1.0).abs() < 0.02);
        assert!((fine.area() / coarse.area() - 1.0).abs() < 0.03);
    }
}

#[test]
fn the_same_arguments_give_the_same_bits_on_any_number_of_threads() {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let make = || sculpture(Figure::Hare, 1.0, LEAST_DETAIL);
    assert_eq!(alone.install(make), three.install(make));
    assert_eq!(sculpture(Figure::Hare, 1.0, 1), make());
}

/// Whatever the field, the surface is closed and stays so: here a lattice of tubes far too fine for its cells.
#[test]
fn hopeless_fields_still_give_closed_surfaces() {
    struct Gyroid(f64);
    impl Field for Gyroid {
        fn distance(&self, p: DVec3) -> f64 {
            let (q, (sin, cos)) = (p * self.0, ((p * self.0).map(f64::sin), (p * self.0).map(f64::cos)));
            let gyroid = (sin.x * cos.y + sin.y * cos.z + sin.z * cos.x).abs() - 0.2;
            clay::meet(gyroid / self.0, q.length() / self.0 - 1.0, 0.1)
        }
        fn bounds(&self) -> (DVec3, DVec3) {
            (DVec3::splat(-1.1), DVec3::splat(1.1))
        }
    }
    for frequency in [3.0, 8.0, 25.0] {
        let field = Gyroid(frequency);
        let surface = remesh::remesh(polygonise::polygonise(&field, 0.12), &field, 0.15);
        // By index, since the field may draw separate vertices to one place.
        let mut edges: Vec<(u32, u32)> =
            surface.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        let directed = edges.len();
        edges.sort_unstable();
        edges.dedup();
        assert_eq!(edges.len(), directed, "an edge runs the same way twice");
        assert!(edges.iter().all(|(a, b)| edges.binary_search(&(*b, *a)).is_ok()), "an edge has one side");
    }
}
