//! Everything that makes a picture: each technique of the registry, and each integrator with each kind of light. What is
//! added there is here too.

use diaphane::reference::Integrator;
use diaphane::reference::volume::Light;
use diaphane::scene::TechniqueText;
use diaphane::techniques::REGISTRY;
use diaphane::techniques::reference::Reference;
use serde::de::{self, Deserialize, Deserializer, Visitor};
use std::fmt;

#[derive(Clone)]
pub struct Column {
    /// In the table.
    pub name: String,
    /// What a view names.
    pub technique: String,
    pub is_traced: bool,
}

impl Column {
    pub fn drawn(name: &str) -> Column {
        Column { name: name.into(), technique: format!("{name}()"), is_traced: false }
    }
}

/// Settings that make other light, and so have columns of their own.
const OTHERWISE: [&str; 2] = ["FilteredNormals(signal: Irradiance)", "Layered(multiple: true)"];

/// Few paths, so that the grid is done in time: what is looked for is not noise.
const SAMPLES: u32 = 8;
const MAX_DEPTH: u32 = 64;

pub fn all() -> Vec<Column> {
    let mut columns = Vec::new();
    for entry in REGISTRY {
        let column = Column::drawn(entry.name);
        let text = TechniqueText::from_flag("--technique", &column.technique).expect("a name can be read");
        if Reference::of(&text).expect("it reads without settings").is_none() {
            columns.push(column);
            let settings = OTHERWISE.iter().filter(|text| text.split('(').next() == Some(entry.name));
            columns.extend(settings.map(|text| Column {
                name: text.to_string(),
                technique: text.to_string(),
                is_traced: false,
            }));
            continue;
        }
        for integrator in variants::<Integrator>() {
            for light in variants::<Light>() {
                let goal = format!("max_spp: {SAMPLES}, max_depth: {MAX_DEPTH}");
                columns.push(Column {
                    name: format!("{integrator} {light}"),
                    technique: format!("{}(integrator: {integrator}, light: {light}, {goal})", entry.name),
                    is_traced: true,
                });
            }
        }
    }
    columns
}

/// The names of an enum's variants, as serde knows them.
fn variants<T: for<'de> Deserialize<'de>>() -> &'static [&'static str] {
    let Err(Variants(names)) = T::deserialize(Names) else { panic!("only an enum has variants") };
    names
}

/// Reads nothing: it hears what would be read.
struct Names;

#[derive(Debug)]
struct Variants(&'static [&'static str]);

impl fmt::Display for Variants {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}
impl std::error::Error for Variants {}
impl de::Error for Variants {
    fn custom<T: fmt::Display>(_: T) -> Variants {
        Variants(&[])
    }
}

impl<'de> Deserializer<'de> for Names {
    type Error = Variants;
    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Variants> {
        Err(Variants(&[]))
    }
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Variants> {
        Err(Variants(variants))
    }
    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}
