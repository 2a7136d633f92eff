use super::*;
use crate::geometry::shapes;
use glam::DAffine3;

fn still(_: f64) -> Result<(), Problem> {
    Ok(())
}

fn normals(mesh: &Mesh, laplacian: &Laplacian) -> Vec<DVec3> {
    laplacian.at_samples(mesh.normals.iter().map(|n| n.as_dvec3()))
}

/// Some bumps on a sphere, so that its normals have all frequencies.
fn bumpy(level: u32) -> Mesh {
    let mut mesh = shapes::sphere(1.0, level);
    for p in &mut mesh.positions {
        let r = 1.0 + 0.25 * (5.0 * p.x).sin() * (4.0 * p.y + 1.0).cos() + 0.1 * (11.0 * p.z).sin();
        *p = r * *p;
    }
    mesh.with_normals(crate::geometry::normals::Normals::Smooth { crease_deg: 180.0 })
}

fn smooth_kernels(knee: f64) -> [Kernel; 4] {
    [
        Kernel::Gaussian { width: 1.0 / knee },
        Kernel::Exponential { width: 1.0 / knee },
        Kernel::Diffusion { time: 0.5 / (knee * knee) },
        Kernel::Medium { sigma_tr: knee },
    ]
}

/// The field through a kernel at the samples.
fn through(laplacian: &Laplacian, field: &[DVec3], modes: &Modes, kernel: &Kernel) -> Vec<DVec3> {
    let means = laplacian.means(field);
    let low = kernel.at(0.0, OMEGA_M);
    let sum = modes.sum(laplacian.samples(), |lambda| kernel.at(lambda.sqrt(), OMEGA_M));
    sum.iter().zip(&means).map(|(sum, mean)| *sum + low * *mean).collect()
}

fn worst(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, |m, d| if d <= m { m } else { d })
}

#[test]
fn krylov_agrees_with_every_eigenpair() {
    let mut slivers = bumpy(3);
    for p in slivers.positions.iter_mut().filter(|p| p.y > 0.3) {
        p.x *= 1e-4;
    }
    let slivers = slivers.with_normals(crate::geometry::normals::Normals::Smooth { crease_deg: 180.0 });
    for (name, mesh) in [("bumpy", bumpy(3)), ("slivers", slivers), ("box", shapes::slab(DVec3::new(2.0, 1.0, 0.5), (16, 12)))] {
        let laplacian = Laplacian::of(&mesh);
        let field = normals(&mesh, &laplacian);
        let exact = harmonics::all(&laplacian, &field).unwrap();
        for step in [0.03, 0.06, 0.125, 0.25, 0.5, 1.0, 2.0] {
          for ratio in [2.0, 8.0] {
            let band = (step * OMEGA_M, ratio * step * OMEGA_M);
            let (modes, error) = krylov::modes(&laplacian, &field, band, &still).unwrap();
            print!("{name} band {step} x {ratio}: {} columns, error {error:.1e}:", modes.lambda.len());
            for knee in [band.0, (band.0 * band.1).sqrt(), band.1] {
                for kernel in smooth_kernels(knee) {
                    let (a, b) =
                        (through(&laplacian, &field, &modes, &kernel), through(&laplacian, &field, &exact, &kernel));
                    print!(" {:.0e}", worst(&a, &b));
                }
            }
            println!();
          }
        }
    }
}
