//! The head of a sleeper, its hair drawn back into a knot. About 100 units tall.

use glam::{DVec3, dvec3};

use super::Field;
use super::clay::*;

pub struct Bust {
    /// The left ear (+x); x points away from the head.
    ear: Frame,
}

impl Bust {
    pub fn new() -> Bust {
        Bust { ear: Frame::new(dvec3(17.6, 66.5, -2.5), dvec3(0.0, 24.0, -8.0)) }
    }

    fn head(&self, p: DVec3, m: DVec3) -> f64 {
        let cranium = ellipsoid(p, dvec3(0.0, 77.0, -3.0), dvec3(18.0, 21.0, 22.5));
        let face = ellipsoid(p, dvec3(0.0, 66.0, 6.0), dvec3(14.8, 22.0, 15.5));
        let jaw = round_cone(m, (dvec3(11.3, 58.5, 1.5), 5.4), (dvec3(1.5, 49.7, 13.3), 5.2));
        let chin = ellipsoid(p, dvec3(0.0, 48.6, 17.2), dvec3(4.2, 3.6, 3.4));
        let cheek = ellipsoid(m, dvec3(9.4, 61.0, 11.5), dvec3(5.2, 6.4, 5.6));
        let head = join(join(join(cranium, face, 10.0), jaw, 8.0), chin, 5.0);
        join(head, cheek, 6.0)
    }

    fn eyes(&self, head: f64, m: DVec3) -> f64 {
        let brow = round_cone(m, (dvec3(3.2, 73.8, 19.6), 1.9), (dvec3(12.0, 73.0, 14.6), 1.5));
        let head = join(head, brow, 5.0);
        let socket = ellipsoid(m, dvec3(7.4, 69.4, 22.5), dvec3(5.0, 3.4, 5.4));
        let head = cut(head, socket, 4.0);
        let lid = ellipsoid(m, dvec3(7.3, 68.6, 15.4), dvec3(4.8, 3.9, 4.0));
        let head = join(head, lid, 1.8);
        // The lashes, where the lids meet: a low arc.
        let x = m.x - 7.3;
        let lashes = groove((m.y - 66.5 - 0.07 * x * x) / (1.0 + 0.02 * x * x).sqrt(), 0.85, 0.5);
        head + lashes * ramp(m.z, 8.0, 12.0) * ramp(4.9 - x.abs(), 0.0, 1.2)
    }

    fn nose(&self, head: f64, p: DVec3, m: DVec3) -> f64 {
        let bridge = round_cone(p, (dvec3(0.0, 72.0, 20.2), 1.6), (dvec3(0.0, 61.6, 25.0), 2.2));
        let tip = sphere(p, dvec3(0.0, 60.9, 25.4), 2.5);
        let wing = ellipsoid(m, dvec3(2.7, 60.3, 22.8), dvec3(1.9, 1.8, 2.6));
        let nose = join(join(bridge, tip, 2.5), wing, 2.0);
        let nostril = ellipsoid(m, dvec3(1.5, 58.3, 24.0), dvec3(0.9, 0.9, 1.4));
        cut(join(head, nose, 3.2), nostril, 1.4)
    }

    fn mouth(&self, head: f64, p: DVec3, m: DVec3) -> f64 {
        let muzzle = ellipsoid(p, dvec3(0.0, 54.5, 15.8), dvec3(7.2, 6.0, 5.8));
        let head = join(head, muzzle, 6.0);
        let upper = round_cone(m, (dvec3(1.3, 55.0, 21.3), 1.7), (dvec3(5.4, 53.9, 18.6), 0.9));
        let lower = round_cone(m, (dvec3(0.6, 51.9, 20.9), 2.0), (dvec3(4.6, 53.0, 18.6), 1.0));
        let head = join(join(head, upper, 2.2), lower, 2.2);
        let corner = ramp(7.2 - m.x, 0.0, 2.0);
        let line = groove(m.y - 53.55 - 0.25 * (0.9 * m.x).cos() * ramp(4.0 - m.x, 0.0, 3.0), 0.85, 0.6) * corner;
        let philtrum = groove(p.x, 0.9, 0.5) * ramp(p.y, 55.5, 56.5) * ramp(60.0 - p.y, 0.0, 1.5);
        head + (line + philtrum) * ramp(p.z, 8.0, 12.0)
    }

    fn ears(&self, m: DVec3) -> f64 {
        let p = self.ear.local(m);
        let shell = ellipsoid(p, dvec3(0.0, 1.0, 0.0), dvec3(2.0, 6.2, 3.9));
        let lobe = sphere(p, dvec3(-0.2, -5.0, 1.2), 1.6);
        let bowl = ellipsoid(p, dvec3(1.9, 1.2, 0.4), dvec3(1.5, 4.4, 2.3));
        cut(join(shell, lobe, 2.0), bowl, 1.4)
    }

    /// Combed back from the forehead in strands.
    fn hair(&self, p: DVec3) -> f64 {
        let cap = ellipsoid(p, dvec3(0.0, 79.0, -4.6), dvec3(19.4, 20.6, 23.0));
        let strands = (26.0 * p.x.atan2(p.y - 70.0)).cos() * ramp(p.z, -24.0, -10.0) * ramp(p.y, 66.0, 76.0);
        let cap = cap - 0.28 * strands;
        // The hairline: behind the face, and behind and above the ears.
        let behind = (p - dvec3(0.0, 88.5, 13.0)).dot(dvec3(0.0, -0.5, 0.866));
        let above = 63.0 + 7.0 * ramp(p.z, -14.0, -2.0) - p.y;
        let cap = meet(meet(cap, behind, 2.0), above, 3.0);
        let knot = ellipsoid(p, dvec3(0.0, 80.0, -30.0), dvec3(7.4, 7.0, 6.4));
        let turn = (5.0 * (p.y - 80.0).atan2(p.x) + 0.9 * (p.z + 30.0)).cos();
        join(cap, knot - 0.25 * turn * ramp((p.truncate() - dvec3(0.0, 80.0, 0.0).truncate()).length(), 0.5, 4.0), 2.0)
    }

    fn neck(&self, p: DVec3, m: DVec3) -> f64 {
        let neck = round_cone(p, (dvec3(0.0, 54.0, -7.0), 10.0), (dvec3(0.0, 20.0, -9.0), 11.0));
        let muscle = round_cone(m, (dvec3(11.0, 56.0, -6.0), 2.6), (dvec3(2.4, 23.0, 3.4), 2.0));
        let shoulders = ellipsoid(p, dvec3(0.0, 6.0, -8.5), dvec3(29.0, 17.0, 14.5));
        let slope = round_cone(m, (dvec3(6.0, 33.0, -11.0), 6.0), (dvec3(22.0, 13.0, -9.0), 7.0));
        let collar = round_cone(m, (dvec3(3.4, 20.0, 2.2), 1.4), (dvec3(20.0, 21.0, -5.5), 1.4));
        join(join(join(neck, muscle, 5.0), join(shoulders, slope, 8.0), 9.0), collar, 6.0)
    }
}

impl Field for Bust {
    fn distance(&self, p: DVec3) -> f64 {
        let m = mirrored(p);
        // Parts are asked only within reach: that is half of the time.
        let mut figure = self.head(p, m);
        if p.z > 3.0 {
            figure = self.eyes(figure, m);
            figure = self.mouth(figure, p, m);
            figure = self.nose(figure, p, m);
        } else {
            figure = join(figure, self.ears(m), 1.6);
        }
        if p.y > 55.0 {
            figure = join(figure, self.hair(p), 1.2);
        }
        if p.y < 66.0 {
            figure = join(figure, self.neck(p, m), 5.0);
        }
        meet(figure, -p.y, 2.0)
    }

    fn bounds(&self) -> (DVec3, DVec3) {
        (dvec3(-34.0, 0.0, -40.0), dvec3(34.0, 100.5, 32.0))
    }
}
