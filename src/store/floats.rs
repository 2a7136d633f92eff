//! Every floating-point number of a value that serde can write down, with its place in it: for whoever looks for one that
//! should not be there.

use serde::ser::{self, Serialize, Serializer};
use std::fmt;

/// One step on the way into a value.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Field(&'static str),
    Index(usize),
}

/// Where in a value something stands, as Rust would write it: `normals[7][2]`.
pub struct Place<'a>(&'a [Part]);

impl fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().enumerate().try_for_each(|(i, part)| match part {
            Part::Field(name) if i == 0 => f.write_str(name),
            Part::Field(name) => write!(f, ".{name}"),
            Part::Index(index) => write!(f, "[{index}]"),
        })
    }
}

/// Is told a number and where it stands.
pub type Each<'a> = dyn FnMut(&Place, f64) + 'a;

/// Tells `each` every f32 and f64 of a value.
pub fn floats<T: Serialize + ?Sized>(value: &T, each: &mut Each) {
    // The only errors are those of a value that refuses to be written down, and no bake's value does.
    value.serialize(&mut Walk { way: Vec::new(), each }).expect("a bake's value can be written down");
}

struct Walk<'a> {
    way: Vec<Part>,
    each: &'a mut Each<'a>,
}

impl Walk<'_> {
    fn inside<T: Serialize + ?Sized>(&mut self, part: Part, value: &T) -> Result<(), fmt::Error> {
        self.way.push(part);
        value.serialize(&mut *self)?;
        self.way.pop();
        Ok(())
    }

    fn begin(&mut self) -> Result<&mut Self, fmt::Error> {
        self.way.push(Part::Index(0));
        Ok(self)
    }

    fn element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), fmt::Error> {
        value.serialize(&mut *self)?;
        if let Some(Part::Index(index)) = self.way.last_mut() {
            *index += 1;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), fmt::Error> {
        self.way.pop();
        Ok(())
    }
}

macro_rules! pass_over {
    ($($method:ident($($argument:ty),*)),* $(,)?) => {
        $(fn $method(self, $(_: $argument),*) -> Result<(), fmt::Error> { Ok(()) })*
    };
}

impl<'w> Serializer for &mut Walk<'w> {
    type Ok = ();
    type Error = fmt::Error;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    pass_over! {
        serialize_bool(bool), serialize_char(char), serialize_str(&str), serialize_bytes(&[u8]),
        serialize_i8(i8), serialize_i16(i16), serialize_i32(i32), serialize_i64(i64),
        serialize_u8(u8), serialize_u16(u16), serialize_u32(u32), serialize_u64(u64),
        serialize_none(), serialize_unit(), serialize_unit_struct(&'static str),
        serialize_unit_variant(&'static str, u32, &'static str),
    }
    fn serialize_f32(self, v: f32) -> Result<(), fmt::Error> {
        self.serialize_f64(v.into())
    }
    fn serialize_f64(self, v: f64) -> Result<(), fmt::Error> {
        (self.each)(&Place(&self.way), v);
        Ok(())
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), fmt::Error> {
        value.serialize(self)
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Result<(), fmt::Error> {
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        value: &T,
    ) -> Result<(), fmt::Error> {
        value.serialize(self)
    }
    fn serialize_seq(self, _: Option<usize>) -> Result<Self, fmt::Error> {
        self.begin()
    }
    fn serialize_tuple(self, _: usize) -> Result<Self, fmt::Error> {
        self.begin()
    }
    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, fmt::Error> {
        self.begin()
    }
    fn serialize_tuple_variant(self, _: &'static str, _: u32, _: &'static str, _: usize) -> Result<Self, fmt::Error> {
        self.begin()
    }
    fn serialize_map(self, _: Option<usize>) -> Result<Self, fmt::Error> {
        self.begin()
    }
    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, fmt::Error> {
        Ok(self)
    }
    fn serialize_struct_variant(self, _: &'static str, _: u32, _: &'static str, _: usize) -> Result<Self, fmt::Error> {
        Ok(self)
    }
}

macro_rules! elements {
    ($($trait:ident: $method:ident),* $(,)?) => {
        $(impl ser::$trait for &mut Walk<'_> {
            type Ok = ();
            type Error = fmt::Error;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), fmt::Error> { self.element(value) }
            fn end(self) -> Result<(), fmt::Error> { self.finish() }
        })*
    };
}
elements! {
    SerializeSeq: serialize_element,
    SerializeTuple: serialize_element,
    SerializeTupleStruct: serialize_field,
    SerializeTupleVariant: serialize_field,
}

macro_rules! fields {
    ($($trait:ident),* $(,)?) => {
        $(impl ser::$trait for &mut Walk<'_> {
            type Ok = ();
            type Error = fmt::Error;
            fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), fmt::Error> {
                self.inside(Part::Field(name), value)
            }
            fn end(self) -> Result<(), fmt::Error> { Ok(()) }
        })*
    };
}
fields!(SerializeStruct, SerializeStructVariant);

impl ser::SerializeMap for &mut Walk<'_> {
    type Ok = ();
    type Error = fmt::Error;
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), fmt::Error> {
        key.serialize(&mut **self)
    }
    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), fmt::Error> {
        self.element(value)
    }
    fn end(self) -> Result<(), fmt::Error> {
        self.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_found_at_its_place() {
        #[derive(serde::Serialize)]
        struct Leaf(f32);
        #[derive(serde::Serialize)]
        enum Kind {
            Round { radius: f64 },
            Flat(f64, f64),
        }
        #[derive(serde::Serialize)]
        struct Tree {
            name: &'static str,
            normals: Vec<glam::Vec3>,
            kinds: Vec<Kind>,
            rest: Option<(u32, Leaf)>,
            by_name: std::collections::BTreeMap<u8, f64>,
        }
        let tree = Tree {
            name: "oak",
            normals: vec![glam::Vec3::ZERO, glam::vec3(1.0, 2.0, 3.0)],
            kinds: vec![Kind::Round { radius: 4.0 }, Kind::Flat(5.0, f64::NAN)],
            rest: Some((7, Leaf(8.0))),
            by_name: [(3, 9.0)].into(),
        };
        let mut found = Vec::new();
        floats(&tree, &mut |place, value| found.push(format!("{place} {value}")));
        let expected = [
            "normals[0][0] 0",
            "normals[0][1] 0",
            "normals[0][2] 0",
            "normals[1][0] 1",
            "normals[1][1] 2",
            "normals[1][2] 3",
            "kinds[0].radius 4",
            "kinds[1][0] 5",
            "kinds[1][1] NaN",
            "rest[1] 8",
            "by_name[0] 9",
        ];
        assert_eq!(found, expected);
    }
}
