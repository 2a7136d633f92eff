//! Names: the content hash of anything that serde can write down.
//!
//! What is hashed is a tagged, length-prefixed spelling of the value, so that no two different values of one type have
//! the same spelling. Maps must come in a fixed order (`BTreeMap`): a `HashMap` would name one value in many ways.

use serde::de::{self, Deserialize, Deserializer};
use serde::ser::{self, Serialize, Serializer};
use std::fmt;

/// The name of a value: 32 bytes of BLAKE3.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// The name of plain bytes: a file.
    pub fn of_bytes(bytes: &[u8]) -> Key {
        Key(*blake3::hash(bytes).as_bytes())
    }

    /// The name of a value.
    pub fn of<T: Serialize + ?Sized>(value: &T) -> Key {
        let mut spelling = Spelling::default();
        spelling.write(value);
        spelling.finish().0
    }

    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// Enough of the name for people: 12 hex digits.
    pub fn short(&self) -> String {
        self.to_string()[..12].to_string()
    }
}

impl From<[u8; 32]> for Key {
    fn from(bytes: [u8; 32]) -> Key {
        Key(bytes)
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.short())
    }
}

impl Serialize for Key {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Key, D::Error> {
        <[u8; 32]>::deserialize(deserializer).map(Key)
    }
}

/// What a slot calls itself when it is spelled: [`Spelling`] then notes which slot was named, and hashes its key only,
/// since its place in the plan is no part of what it holds.
pub(super) const SLOT: &str = "\u{0}slot";

/// A slot's place (4 bytes) and key (32 bytes), as it travels through serde.
pub(super) struct SlotBytes(pub [u8; 36]);

impl SlotBytes {
    pub fn new(index: u32, key: &Key) -> SlotBytes {
        let mut bytes = [0; 36];
        bytes[..4].copy_from_slice(&index.to_le_bytes());
        bytes[4..].copy_from_slice(&key.0);
        SlotBytes(bytes)
    }
}

impl Serialize for SlotBytes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

/// Spells values, and collects the slots that it meets on the way. What is named is small (parameters, and names of what is
/// large), so it is spelled out first and hashed in one go, which is much faster than piece by piece.
#[derive(Default)]
pub(super) struct Spelling {
    spelled: Vec<u8>,
    slots: Vec<u32>,
    in_slot: bool,
}

impl Spelling {
    pub fn write<T: Serialize + ?Sized>(&mut self, value: &T) {
        // The only errors are our own (below): a sequence of unknown length, which is a mistake in the program.
        value.serialize(&mut *self).expect("every value that is named can be spelled");
    }

    /// The name, and the places of the slots that the value holds, in the order of its fields.
    pub fn finish(self) -> (Key, Vec<u32>) {
        (Key::of_bytes(&self.spelled), self.slots)
    }

    fn tag(&mut self, tag: u8, bytes: &[u8]) -> Result<(), Unspellable> {
        self.spelled.push(tag);
        self.spelled.extend_from_slice(bytes);
        Ok(())
    }

    fn text(&mut self, tag: u8, text: &str) -> Result<(), Unspellable> {
        self.tag(tag, &(text.len() as u64).to_le_bytes())?;
        self.spelled.extend_from_slice(text.as_bytes());
        Ok(())
    }

    fn length(&mut self, tag: u8, length: Option<usize>) -> Result<(), Unspellable> {
        self.tag(tag, &(length.ok_or(Unspellable("a sequence of unknown length".into()))? as u64).to_le_bytes())
    }
}

#[derive(Debug)]
pub(super) struct Unspellable(String);

impl fmt::Display for Unspellable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
impl std::error::Error for Unspellable {}
impl ser::Error for Unspellable {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Unspellable(message.to_string())
    }
}
impl de::Error for Unspellable {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Unspellable(message.to_string())
    }
}

macro_rules! spell_numbers {
    ($($method:ident: $type:ty = $tag:literal),* $(,)?) => {
        $(fn $method(self, v: $type) -> Result<(), Unspellable> { self.tag($tag, &v.to_le_bytes()) })*
    };
}

impl Serializer for &mut Spelling {
    type Ok = ();
    type Error = Unspellable;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    spell_numbers! {
        serialize_i8: i8 = 1, serialize_i16: i16 = 2, serialize_i32: i32 = 3, serialize_i64: i64 = 4,
        serialize_u8: u8 = 5, serialize_u16: u16 = 6, serialize_u32: u32 = 7, serialize_u64: u64 = 8,
        serialize_f32: f32 = 9, serialize_f64: f64 = 10,
    }
    fn serialize_bool(self, v: bool) -> Result<(), Unspellable> {
        self.tag(11, &[v as u8])
    }
    fn serialize_char(self, v: char) -> Result<(), Unspellable> {
        self.tag(12, &(v as u32).to_le_bytes())
    }
    fn serialize_str(self, v: &str) -> Result<(), Unspellable> {
        self.text(13, v)
    }
    fn serialize_bytes(self, v: &[u8]) -> Result<(), Unspellable> {
        if std::mem::take(&mut self.in_slot) {
            self.slots.push(u32::from_le_bytes(v[..4].try_into().expect("a slot has 36 bytes")));
            return self.tag(14, &v[4..]);
        }
        self.length(15, Some(v.len()))?;
        self.spelled.extend_from_slice(v);
        Ok(())
    }
    fn serialize_none(self) -> Result<(), Unspellable> {
        self.tag(16, &[])
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Unspellable> {
        self.tag(17, &[])?;
        value.serialize(self)
    }
    fn serialize_unit(self) -> Result<(), Unspellable> {
        self.tag(18, &[])
    }
    fn serialize_unit_struct(self, name: &'static str) -> Result<(), Unspellable> {
        self.text(19, name)
    }
    fn serialize_unit_variant(self, _: &'static str, _: u32, variant: &'static str) -> Result<(), Unspellable> {
        self.text(20, variant)
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, name: &'static str, value: &T) -> Result<(), Unspellable> {
        self.in_slot = name == SLOT;
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Unspellable> {
        self.text(21, variant)?;
        value.serialize(self)
    }
    fn serialize_seq(self, len: Option<usize>) -> Result<Self, Unspellable> {
        self.length(22, len)?;
        Ok(self)
    }
    fn serialize_tuple(self, len: usize) -> Result<Self, Unspellable> {
        self.length(23, Some(len))?;
        Ok(self)
    }
    fn serialize_tuple_struct(self, _: &'static str, len: usize) -> Result<Self, Unspellable> {
        self.serialize_tuple(len)
    }
    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        len: usize,
    ) -> Result<Self, Unspellable> {
        self.text(24, variant)?;
        self.serialize_tuple(len)
    }
    fn serialize_map(self, len: Option<usize>) -> Result<Self, Unspellable> {
        self.length(25, len)?;
        Ok(self)
    }
    // By its name: two steps may read the same and make something else of it.
    fn serialize_struct(self, name: &'static str, len: usize) -> Result<Self, Unspellable> {
        self.text(26, name)?;
        self.length(26, Some(len))?;
        Ok(self)
    }
    fn serialize_struct_variant(
        self,
        name: &'static str,
        _: u32,
        variant: &'static str,
        len: usize,
    ) -> Result<Self, Unspellable> {
        self.text(27, variant)?;
        self.serialize_struct(name, len)
    }
}

macro_rules! spell_elements {
    ($($trait:ident: $method:ident),* $(,)?) => {
        $(impl ser::$trait for &mut Spelling {
            type Ok = ();
            type Error = Unspellable;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Unspellable> {
                value.serialize(&mut **self)
            }
            fn end(self) -> Result<(), Unspellable> { Ok(()) }
        })*
    };
}
spell_elements! {
    SerializeSeq: serialize_element,
    SerializeTuple: serialize_element,
    SerializeTupleStruct: serialize_field,
    SerializeTupleVariant: serialize_field,
}

macro_rules! spell_fields {
    ($($trait:ident),* $(,)?) => {
        $(impl ser::$trait for &mut Spelling {
            type Ok = ();
            type Error = Unspellable;
            fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Unspellable> {
                self.text(28, name)?;
                value.serialize(&mut **self)
            }
            fn end(self) -> Result<(), Unspellable> { Ok(()) }
        })*
    };
}
spell_fields!(SerializeStruct, SerializeStructVariant);

impl ser::SerializeMap for &mut Spelling {
    type Ok = ();
    type Error = Unspellable;
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Unspellable> {
        key.serialize(&mut **self)
    }
    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Unspellable> {
        value.serialize(&mut **self)
    }
    fn end(self) -> Result<(), Unspellable> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_differ_have_different_names() {
        #[derive(serde::Serialize)]
        enum Shape {
            Round(f64),
            Flat { width: f64 },
            Tall { height: f64 },
            Nothing,
        }
        #[derive(serde::Serialize)]
        struct Ends {
            of: u32,
        }
        #[derive(serde::Serialize)]
        struct Middle {
            of: u32,
        }
        let names = [
            Key::of(&1.0f64),
            Key::of(&1.0f32),
            Key::of(&1u32),
            Key::of(&1u64),
            Key::of(&Some(1u32)),
            Key::of(&None::<u32>),
            Key::of(&("a", "bc")),
            Key::of(&("ab", "c")),
            Key::of(&vec!["a", "bc"]),
            Key::of(&vec![vec![1u8], vec![]]),
            Key::of(&vec![vec![], vec![1u8]]),
            Key::of(&Shape::Round(1.0)),
            Key::of(&Shape::Flat { width: 1.0 }),
            Key::of(&Shape::Tall { height: 1.0 }),
            Key::of(&Shape::Nothing),
            Key::of(&Ends { of: 1 }),
            Key::of(&Middle { of: 1 }),
            Key::of(&0.0f64),
            Key::of(&-0.0f64),
        ];
        let distinct: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(distinct.len(), names.len());
    }

    #[test]
    fn equal_values_have_one_name() {
        assert_eq!(Key::of(&(1, "two", [3.0])), Key::of(&(1, "two", [3.0])));
    }
}
