//! A hare that sits upright and listens. About 100 units tall, most of it ears.

use glam::{DVec2, DVec3, dvec3};

use super::Field;
use super::clay::*;

pub struct Hare {
    head: Frame,
    /// Left (+x) and right, within the head.
    ears: [Frame; 2],
}

impl Hare {
    pub fn new() -> Hare {
        Hare {
            head: Frame::new(dvec3(0.0, 58.0, 9.0), dvec3(6.0, 13.0, -3.0)),
            ears: [
                Frame::new(dvec3(3.7, 5.0, -4.2), dvec3(-14.0, 20.0, -10.0)),
                Frame::new(dvec3(-3.7, 5.0, -4.2), dvec3(-24.0, -38.0, 17.0)),
            ],
        }
    }

    fn body(&self, p: DVec3) -> f64 {
        let m = mirrored(p);
        let rump = ellipsoid(p, dvec3(0.0, 19.0, -13.0), dvec3(15.0, 18.0, 18.5));
        let back = round_cone(p, (dvec3(0.0, 23.0, -11.0), 16.0), (dvec3(0.0, 39.0, 3.0), 11.0));
        let chest = ellipsoid(p, dvec3(0.0, 32.0, 6.5), dvec3(10.5, 16.0, 11.0));
        let belly = round_cone(p, (dvec3(0.0, 12.0, -6.0), 11.0), (dvec3(0.0, 26.0, 5.0), 9.0));
        let neck = round_cone(p, (dvec3(0.0, 41.0, 4.5), 8.6), (dvec3(0.0, 55.0, 6.5), 6.0));
        let torso = join(join(join(rump, back, 8.0), join(chest, belly, 6.0), 8.0), neck, 9.0);
        let tail = ellipsoid(p, dvec3(0.0, 11.0, -32.0), dvec3(5.2, 6.6, 5.4));
        let torso = join(torso, tail, 3.0);

        let thigh = Frame::new(dvec3(11.0, 17.0, -8.0), dvec3(-28.0, 8.0, 0.0)).local(m);
        let thigh = ellipsoid(thigh, DVec3::ZERO, dvec3(7.5, 13.5, 15.5));
        let knee = ellipsoid(m, dvec3(13.3, 13.0, 3.0), dvec3(5.0, 7.0, 6.0));
        let foot = round_cone(m, (dvec3(12.0, 3.2, -12.0), 3.8), (dvec3(12.8, 2.4, 12.0), 3.4));
        let toes = ellipsoid(m, dvec3(12.8, 2.4, 13.5), dvec3(4.2, 3.3, 4.8));
        let foot = toed(join(foot, toes, 3.0), m - dvec3(12.9, 0.0, 14.5));
        let hind = join(join(thigh, knee, 8.0), foot, 3.0);

        let shoulder = ellipsoid(m, dvec3(7.4, 31.0, 7.5), dvec3(5.2, 12.0, 7.6));
        let leg = round_cone(m, (dvec3(6.6, 25.0, 11.0), 5.0), (dvec3(5.2, 7.0, 14.8), 3.1));
        let paw = round_cone(m, (dvec3(5.2, 3.2, 15.0), 3.4), (dvec3(5.4, 2.4, 19.5), 3.2));
        let fore = join(join(shoulder, leg, 8.0), toed(paw, m - dvec3(5.4, 0.0, 19.0)), 2.5);

        join(join(torso, hind, 2.5), fore, 4.0)
    }

    fn head(&self, p: DVec3) -> f64 {
        let m = mirrored(p);
        // Narrow, long and deep, its profile one curve from the ears to the nose.
        let narrow = |p: DVec3| dvec3(1.1 * p.x, p.y, p.z);
        let skull = round_cone(narrow(p), (dvec3(0.0, 1.2, -1.8), 7.6), (dvec3(0.0, -2.6, 8.6), 5.0));
        let cheek = ellipsoid(m, dvec3(3.4, -4.0, 1.5), dvec3(4.0, 5.0, 6.8));
        let pad = ellipsoid(m, dvec3(1.9, -4.3, 11.6), dvec3(2.8, 2.6, 3.2));
        let chin = ellipsoid(p, dvec3(0.0, -6.9, 9.2), dvec3(2.6, 2.1, 3.4));
        let head = join(join(join(skull, cheek, 5.0), chin, 2.5), pad, 1.6);

        // The eye is large, stands out at the side and looks out from under a lid.
        let eye = dvec3(5.1, 1.7, 4.0);
        let orbit = ellipsoid(m, eye - dvec3(0.8, 0.0, 0.2), dvec3(2.7, 3.9, 4.6));
        let head = join(head, orbit, 3.0);
        let ball = ellipsoid(m, eye + dvec3(0.25, 0.0, 0.2), dvec3(2.4, 2.4, 2.9));
        let lid = round_cone(m, (eye + dvec3(0.6, 2.3, 2.6), 0.5), (eye + dvec3(1.5, 2.5, -2.0), 0.7));
        let seen = (m - eye - dvec3(0.6, 0.0, 0.2)) / dvec3(1.0, 2.5, 2.9);
        let rim = groove(2.6 * (seen.y.hypot(seen.z) - 1.0), 0.6, 0.4) * ramp(m.x, 3.5, 5.5);
        let head = join(join(head, lid, 2.2), ball, 0.9) + rim;

        let nose = ellipsoid(p, dvec3(0.0, -1.9, 13.7), dvec3(2.0, 1.2, 1.3));
        let head = join(head, nose, 1.2);
        let front = ramp(p.z, 9.0, 12.0);
        let cleft = groove(p.x, 0.85, 0.5) * front * ramp(-p.y, 2.6, 3.6) * ramp(p.y, -8.0, -6.5);
        head + cleft
    }

    /// A leaf of nearly even thickness, cupped towards +z, more deeply at its root; y runs along it.
    fn ear(&self, p: DVec3) -> f64 {
        const LENGTH: f64 = 40.0;
        const WIDTH: f64 = 5.6;
        // Two arcs, rounded where they meet at the tip; the lower tip lies inside the head.
        let radius = 0.5 * WIDTH + LENGTH * LENGTH / (8.0 * WIDTH);
        let arc = |side: f64| DVec2::new(p.x + side * (radius - WIDTH), p.y - 0.42 * LENGTH).length() - radius;
        let outline = meet(arc(1.0), arc(-1.0), 4.0);
        // It leans back, and its tip comes forward again.
        let s = p.y / LENGTH;
        let lean = 6.0 * s * s * (1.0 - 0.9 * s);
        let cup = (0.075 + 0.13 * (1.0 - ramp(s, -0.1, 0.5))) * p.x * p.x;
        let across = p.z + lean - cup;
        let thickness = 1.15 + 0.8 * (1.0 - ramp(s, 0.0, 0.4));
        // Cupping and bending stretch distances.
        0.8 * ((outline + thickness).max(0.0).hypot(across) - thickness)
    }
}

/// A foot with two grooves between three toes; `p` is seen from where the toes begin.
fn toed(foot: f64, p: DVec3) -> f64 {
    foot + groove(p.x.abs() - 1.3 - 0.08 * p.z, 0.55, 0.8) * ramp(p.z, -0.5, 2.0)
}

impl Field for Hare {
    fn distance(&self, p: DVec3) -> f64 {
        // Head and body are within each other's reach at the neck only.
        let body = if p.y < 68.0 { self.body(p) } else { f64::INFINITY };
        let figure = if p.y < 38.0 {
            body
        } else {
            let in_head = self.head.local(p);
            let mut head = self.head(in_head);
            if p.y > 56.0 {
                for ear in &self.ears {
                    head = join(head, self.ear(ear.local(in_head)), 2.2);
                }
            }
            if body.is_finite() { join(body, head, 4.0) } else { head }
        };
        // It stands on the ground.
        meet(figure, -p.y, 1.5)
    }

    fn bounds(&self) -> (DVec3, DVec3) {
        (dvec3(-24.0, 0.0, -40.0), dvec3(24.0, 102.0, 30.0))
    }
}
