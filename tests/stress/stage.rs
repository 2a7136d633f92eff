//! A still life whose every length, coefficient and light can be pushed to where things break.

use glam::{DVec3, dvec3};

/// A thing on a floor. Lengths are told as if the scene were of usual size, and written times `size`.
#[derive(Clone)]
pub struct Stage {
    /// All lengths of the scene, and the places that lights shine from, are multiplied by this.
    pub size: f64,
    pub mm_per_unit: f64,
    /// All of the medium's coefficients are multiplied by this.
    pub density: f64,
    /// Added to every place, after `size`: scene units.
    pub at: DVec3,
    pub medium: Medium,
    /// What stands in `surface: ( )`.
    pub surface: String,
    /// What stands in `layers: [ ]`; depths in mm.
    pub layers: String,
    pub shape: Shape,
    pub lamps: Vec<Lamp>,
    /// The thing alone, without the floor.
    pub is_alone: bool,
    pub eye: DVec3,
    pub target: DVec3,
    pub up: DVec3,
    pub fov_y_deg: f64,
    /// Pixels.
    pub picture: (u32, u32),
    /// More of an object's fields.
    pub wears: String,
    pub time_s: f64,
}

#[derive(Clone)]
pub struct Medium {
    /// 1/mm
    pub sigma_a: [f64; 3],
    pub sigma_s: [f64; 3],
    pub g: f64,
    pub phase: &'static str,
}

#[derive(Clone)]
pub enum Shape {
    Sphere {
        subdivisions: u32,
    },
    Slab {
        size: DVec3,
    },
    /// A mesh's OBJ text for this size, or the path of a file with the scale that brings it to radius 1.
    Obj(String),
    File {
        path: String,
        scale: f64,
    },
}

#[derive(Clone)]
pub enum Lamp {
    Directional { direction: DVec3, irradiance: f64 },
    Point { position: DVec3, intensity: f64 },
    Rect { center: DVec3, u: DVec3, v: DVec3, radiance: f64 },
    Sky { radiance: f64 },
}

impl Lamp {
    /// The same, of another power.
    pub fn times(&self, factor: f64) -> Lamp {
        let mut lamp = self.clone();
        match &mut lamp {
            Lamp::Directional { irradiance: power, .. }
            | Lamp::Point { intensity: power, .. }
            | Lamp::Rect { radiance: power, .. }
            | Lamp::Sky { radiance: power } => *power *= factor,
        }
        lamp
    }
}

pub const SUN: Lamp = Lamp::Directional { direction: dvec3(-1.0, -2.0, -1.0), irradiance: 3.0 };
pub const BULB: Lamp = Lamp::Point { position: dvec3(2.0, 3.0, 2.5), intensity: 8.0 };
pub const PANEL: Lamp =
    Lamp::Rect { center: dvec3(-3.0, 3.0, -2.0), u: dvec3(0.6, 0.6, 0.0), v: dvec3(0.0, 0.0, 1.0), radiance: 6.0 };
pub const SKY: Lamp = Lamp::Sky { radiance: 0.3 };

/// Waxen: light spreads over a third of the thing.
pub const WAX: Medium =
    Medium { sigma_a: [0.01, 0.02, 0.05], sigma_s: [1.0, 1.2, 1.5], g: 0.2, phase: "HenyeyGreenstein" };

impl Default for Stage {
    fn default() -> Stage {
        Stage {
            size: 1.0,
            mm_per_unit: 10.0,
            density: 1.0,
            at: DVec3::ZERO,
            medium: WAX,
            surface: "ior: 1.4, roughness: 0.3".into(),
            layers: String::new(),
            shape: Shape::Sphere { subdivisions: 3 },
            lamps: vec![SUN, BULB, SKY],
            is_alone: false,
            eye: dvec3(1.0, 2.0, 4.5),
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov_y_deg: 32.0,
            picture: (16, 16),
            wears: String::new(),
            time_s: 0.0,
        }
    }
}

/// A scene as files: their names and texts, `scene.ron` among them, without its last bracket, so that a view can follow.
pub struct Files(pub Vec<(&'static str, String)>);

fn vector(v: DVec3) -> String {
    format!("({:?}, {:?}, {:?})", v.x, v.y, v.z)
}

impl Stage {
    pub fn files(&self) -> Files {
        let Medium { sigma_a, sigma_s, g, phase } = &self.medium;
        let triple = |values: [f64; 3]| vector(DVec3::from(values) * self.density);
        let thing = format!(
            "Material(version: 1, surface: ({}), layers: [{}], phase: {phase},
             medium: Coefficients(sigma_a: {}, sigma_s: {}, g: {g:?}))",
            self.surface,
            self.layers,
            triple(*sigma_a),
            triple(*sigma_s)
        );
        let mut files = vec![
            ("thing.ron", thing),
            ("floor.ron", "Material(version: 1, medium: Opaque(albedo: (0.8, 0.5, 0.2)))".into()),
        ];
        let length = |v: f64| format!("{:?}", self.size * v);
        let (mesh, scale) = match &self.shape {
            Shape::Sphere { subdivisions } => {
                (format!("Sphere(radius: {}, subdivisions: {subdivisions})", length(1.0)), 1.0)
            }
            Shape::Slab { size } => (format!("Slab(size: {}, segments: (16, 16))", vector(self.size * *size)), 1.0),
            Shape::Obj(text) => {
                files.push(("mesh.obj", text.clone()));
                ("File(\"mesh.obj\")".into(), self.size)
            }
            Shape::File { path, scale } => (format!("File({path:?})"), self.size * scale),
        };
        let mut objects = format!(
            "(name: \"thing\", mesh: {mesh}, material: \"thing.ron\",
              transform: (translate: {}, scale: {scale:?}), {}),",
            vector(self.at),
            self.wears
        );
        if !self.is_alone {
            let (floor, place) = (dvec3(12.0, 1.0, 12.0), dvec3(0.0, -1.6, 0.0));
            objects += &format!(
                "(name: \"floor\", mesh: Box(size: {}), material: \"floor.ron\", transform: (translate: {})),",
                vector(self.size * floor),
                vector(self.size * place + self.at)
            );
        }
        let lights: String = self.lamps.iter().map(|lamp| self.lamp(lamp) + ", ").collect();
        let (eye, target) = (self.size * self.eye + self.at, self.size * self.target + self.at);
        let scene = format!(
            "Scene(version: 1, mm_per_unit: {:?},
             camera: (eye: {}, target: {}, up: {}, fov_y_deg: {:?}),
             lights: [{lights}], objects: [{objects}],
             view: (size: {:?}, antialias: 1, time_s: {:?}, technique: ",
            self.mm_per_unit,
            vector(eye),
            vector(target),
            vector(self.up),
            self.fov_y_deg,
            self.picture,
            self.time_s
        );
        files.push(("scene.ron", scene));
        Files(files)
    }

    fn lamp(&self, lamp: &Lamp) -> String {
        let place = |v: DVec3| vector(self.size * v + self.at);
        match *lamp {
            Lamp::Directional { direction, irradiance } => {
                format!("Directional(direction: {}, irradiance: {irradiance:?})", vector(direction))
            }
            // The square of a distance is in scene units too.
            Lamp::Point { position, intensity } => {
                format!("Point(position: {}, intensity: {:?})", place(position), intensity * self.size * self.size)
            }
            Lamp::Rect { center, u, v, radiance } => format!(
                "Rect(center: {}, u: {}, v: {}, radiance: {radiance:?})",
                place(center),
                vector(self.size * u),
                vector(self.size * v)
            ),
            Lamp::Sky { radiance } => format!("Environment(radiance: {radiance:?})"),
        }
    }
}
