//! The forms that a field of a file may take: three numbers or one, a constant or a texture, a technique's own words.

use crate::scene::outside::{Channel, Encoding};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, Deserialize, Deserializer, EnumAccess, VariantAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// A value per channel or axis: `(r, g, b)`, `[r, g, b]`, or one number for all three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triple(pub [f64; 3]);

impl Triple {
    pub const fn all(value: f64) -> Triple {
        Triple([value; 3])
    }
}

impl Serialize for Triple {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(3)?;
        self.0.iter().try_for_each(|v| tuple.serialize_element(v))?;
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Triple {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Triple, D::Error> {
        struct Read;
        impl<'de> Visitor<'de> for Read {
            type Value = Triple;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("three numbers (r, g, b) or one number")
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Triple, E> {
                Ok(Triple::all(value))
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Triple, A::Error> {
                let mut out = [0.0; 3];
                for (i, value) in out.iter_mut().enumerate() {
                    *value = seq.next_element()?.ok_or_else(|| de::Error::invalid_length(i, &self))?;
                }
                Ok(Triple(out))
            }
        }
        deserializer.deserialize_any(Read)
    }
}

/// An image in place of a constant.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureSpec {
    pub image: String,
    /// For one number: which channel holds it.
    #[serde(default)]
    pub channel: Channel,
    /// For one number: what 0 and 1 in the image stand for.
    #[serde(default = "unit_range")]
    pub range: (f64, f64),
    /// High values in the image stand for low numbers.
    #[serde(default)]
    pub invert: bool,
    /// Colours are sRGB unless said; all else is linear.
    #[serde(default)]
    pub encoding: Option<Encoding>,
}

fn unit_range() -> (f64, f64) {
    (0.0, 1.0)
}

/// A constant is allowed wherever a texture is.
#[derive(Clone, Debug, PartialEq)]
pub enum Spec<T> {
    Constant(T),
    Texture(TextureSpec),
}

impl<T: Serialize> Serialize for Spec<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Spec::Constant(value) => value.serialize(serializer),
            Spec::Texture(texture) => serializer.serialize_newtype_variant("Spec", 0, "Texture", texture),
        }
    }
}

impl<'de, T: Deserialize<'de> + Described> Deserialize<'de> for Spec<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Spec<T>, D::Error> {
        struct Read<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de> + Described> Visitor<'de> for Read<T> {
            type Value = Spec<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{} or Texture(image: \"…\")", T::WORDS)
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Spec<T>, E> {
                T::deserialize(de::value::F64Deserializer::new(value)).map(Spec::Constant)
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<Spec<T>, A::Error> {
                match T::TAKES_THREE {
                    true => T::deserialize(SeqAccessDeserializer::new(seq)).map(Spec::Constant),
                    false => Err(de::Error::invalid_type(de::Unexpected::Seq, &self)),
                }
            }
            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<Spec<T>, A::Error> {
                // `(image: "…")` without its name is not what the manual says.
                drop(MapAccessDeserializer::new(map));
                Err(de::Error::invalid_type(de::Unexpected::Map, &self))
            }
            fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Spec<T>, A::Error> {
                #[derive(serde::Deserialize)]
                enum Name {
                    Texture,
                }
                let (Name::Texture, content) = data.variant()?;
                content.newtype_variant().map(Spec::Texture)
            }
        }
        deserializer.deserialize_any(Read(PhantomData))
    }
}

/// What a constant is, in the words of an error.
pub trait Described {
    const WORDS: &'static str;
    const TAKES_THREE: bool;
}
impl Described for f64 {
    const WORDS: &'static str = "a number";
    const TAKES_THREE: bool = false;
}
impl Described for Triple {
    const WORDS: &'static str = "three numbers (r, g, b), one number,";
    const TAKES_THREE: bool = true;
}

/// Words that somebody else reads: a technique with its settings, as canonical RON.
#[derive(Clone, Debug, PartialEq)]
pub struct Raw(pub String);

impl<'de> Deserialize<'de> for Raw {
    /// The tree keeps the words; who fills this in takes them from there.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Raw, D::Error> {
        deserializer.deserialize_ignored_any(de::IgnoredAny).map(|_| Raw(String::new()))
    }
}

impl Serialize for Raw {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        ron::value::RawValue::from_ron(&self.0).map_err(serde::ser::Error::custom)?.serialize(serializer)
    }
}
