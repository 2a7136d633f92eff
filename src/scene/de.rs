//! serde over the tree: typed values from a [`Node`], and errors that know their place.
//!
//! It reads as ron does with `implicit_some` and `unwrap_variant_newtypes`, and is more forgiving in two ways: `Word` and
//! `Word()` are the same variant, and `[a, b]` may stand for `(a, b)`.

use crate::problem::{Problem, nearest};
use crate::scene::tree::{Field, Node, Source, Value};
use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeSeed, Deserializer, Expected, Unexpected, Visitor};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// What does not fit the schema, and the value or name that does not.
#[derive(Debug)]
pub struct Wrong {
    what: String,
    hint: Option<String>,
    place: Option<(Arc<Source>, Range<usize>)>,
    /// It is the type that does not fit, so that the value can be described as it was written.
    mistyped: bool,
}

impl Wrong {
    fn new(what: String, hint: Option<String>) -> Wrong {
        Wrong { what, hint, place: None, mistyped: false }
    }
    /// The innermost place wins, since it is told first.
    fn or_at(mut self, source: &Arc<Source>, span: &Range<usize>) -> Wrong {
        self.place.get_or_insert_with(|| (source.clone(), span.clone()));
        self
    }
    /// `root` is what was read, `path` where it stands in its file.
    pub fn problem(self, root: &Node, path: &str) -> Problem {
        let (source, span) = self.place.unwrap_or((root.source.clone(), root.span.clone()));
        let inner = root.path_of(&source, &span);
        let path =
            if path.is_empty() || inner.is_empty() { format!("{path}{inner}") } else { format!("{path}.{inner}") };
        let mut problem = Problem::files(self.what).at(source.at(span));
        problem.path = Some(path).filter(|p| !p.is_empty());
        problem.hint = self.hint;
        problem
    }
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)
    }
}
impl std::error::Error for Wrong {}

/// "did you mean", or all that is known.
pub fn suggest<'a>(word: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> String {
    let all: Vec<&str> = known.clone().into_iter().collect();
    match nearest(word, known) {
        Some(right) if all.len() > 1 => format!("did you mean `{right}`? Known are {}", all.join(", ")),
        Some(right) => format!("did you mean `{right}`?"),
        None if all.is_empty() => "leave it out: nothing is known here".to_string(),
        None => format!("known are {}", all.join(", ")),
    }
}

impl de::Error for Wrong {
    fn custom<T: fmt::Display>(what: T) -> Wrong {
        Wrong::new(what.to_string(), None)
    }
    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Wrong {
        Wrong { mistyped: true, ..Wrong::new(format!("expected {expected}, found {found}"), None) }
    }
    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Wrong {
        Wrong::invalid_type(found, expected)
    }
    fn invalid_length(found: usize, expected: &dyn Expected) -> Wrong {
        let found = format!("{found} value{}", if found == 1 { "" } else { "s" });
        Wrong::new(format!("expected {expected}, found {found}"), Some(format!("write {expected}")))
    }
    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Wrong {
        Wrong::new(format!("`{word}` is not known here"), Some(suggest(word, known.iter().copied())))
    }
    fn unknown_field(word: &str, known: &'static [&'static str]) -> Wrong {
        Wrong::new(format!("there is no field `{word}`"), Some(suggest(word, known.iter().copied())))
    }
    fn missing_field(name: &'static str) -> Wrong {
        Wrong::new(format!("the field `{name}` is missing"), Some(format!("add `{name}:`")))
    }
    fn duplicate_field(name: &'static str) -> Wrong {
        Wrong::new(format!("`{name}` is given twice"), None)
    }
}

/// Reads a `T`; errors have the place of the offending value.
pub fn from_node<T: de::DeserializeOwned>(node: &Node) -> Result<T, Wrong> {
    T::deserialize(Cursor { node, content: false })
}

#[derive(Clone, Copy)]
struct Cursor<'a> {
    node: &'a Node,
    /// The name was the variant's and has been read: what remains is what stands in its brackets.
    content: bool,
}

impl<'a> Cursor<'a> {
    fn of(node: &'a Node) -> Cursor<'a> {
        Cursor { node, content: false }
    }
    fn name(self) -> Option<&'a str> {
        if self.content { None } else { self.node.name() }
    }
    fn placed<T>(self, result: Result<T, Wrong>) -> Result<T, Wrong> {
        result.map_err(|e| e.or_at(&self.node.source, &self.node.span))
    }
    fn unfit<T>(self, expected: &dyn Expected) -> Result<T, Wrong> {
        let found = match &self.node.value {
            Value::Number(_) => format!("the number {}", self.node.text()),
            Value::Bool(b) => b.to_string(),
            Value::Text(_) => "a text".to_string(),
            Value::Char(_) => "a character".to_string(),
            Value::List(_) => "a list [ ]".to_string(),
            Value::Map(_) => "a map { }".to_string(),
            Value::Word(name) => format!("`{name}`"),
            Value::Tuple(Some(name), _) | Value::Struct(Some(name), _) => format!("`{name}(…)`"),
            Value::Tuple(None, items) if items.is_empty() => "()".to_string(),
            Value::Tuple(None, _) => "values in ( )".to_string(),
            Value::Struct(None, _) => "a struct ( )".to_string(),
        };
        let hint = Some(format!("write {expected}"));
        self.placed(Err(Wrong::new(format!("expected {expected}, found {found}"), hint)))
    }

    fn integer<T: TryFrom<i128>>(self, range: &str) -> Result<T, Wrong> {
        let whole = match self.node.value {
            Value::Number(n) if n.fract() == 0.0 && n.abs() < 9e15 => T::try_from(n as i128).ok(),
            // Above 2^53 the digits say more than the f64 does.
            Value::Number(_) => self.node.text().replace('_', "").parse().ok().and_then(|n: i128| T::try_from(n).ok()),
            _ => None,
        };
        whole.map_or_else(|| self.unfit(&range), Ok)
    }

    fn seq<V: Visitor<'a>>(self, items: &'a [Node], visitor: V) -> Result<V::Value, Wrong> {
        let mut left = items.iter();
        let value = visitor.visit_seq(Items(&mut left))?;
        let left = left.count();
        match left {
            0 => Ok(value),
            _ => {
                let wanted = items.len() - left;
                let what = format!("expected {wanted} values, found {}", items.len());
                Err(Wrong::new(what, Some(format!("write {wanted} values"))))
            }
        }
    }
}

macro_rules! integers {
    ($($method:ident $visit:ident $type:ty),*) => {$(
        fn $method<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
            let range = format!("a whole number from {} to {}", <$type>::MIN, <$type>::MAX);
            let value = self.integer::<$type>(&range)?;
            self.placed(visitor.$visit(value))
        }
    )*};
}

impl<'a> Deserializer<'a> for Cursor<'a> {
    type Error = Wrong;

    fn deserialize_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        let expected = expectation(&visitor);
        let result = match &self.node.value {
            _ if self.name().is_some() => return self.deserialize_enum("", &[], visitor),
            Value::Number(n) => visitor.visit_f64(*n),
            Value::Bool(b) => visitor.visit_bool(*b),
            Value::Text(text) => visitor.visit_borrowed_str(text),
            Value::Char(c) => visitor.visit_char(*c),
            Value::List(items) | Value::Tuple(_, items) => self.seq(items, visitor),
            Value::Map(items) => visitor.visit_map(Entries { left: items.iter(), value: None }),
            Value::Struct(_, fields) => visitor.visit_map(Fields { left: fields.iter(), value: None }),
            Value::Word(_) => visitor.visit_unit(),
        };
        match result {
            Err(e) if e.place.is_none() && e.mistyped => self.unfit(&expected.as_str()),
            result => self.placed(result),
        }
    }

    fn deserialize_bool<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.node.value {
            Value::Bool(b) => self.placed(visitor.visit_bool(b)),
            _ => self.unfit(&"true or false"),
        }
    }
    integers!(deserialize_i8 visit_i8 i8, deserialize_i16 visit_i16 i16, deserialize_i32 visit_i32 i32,
        deserialize_i64 visit_i64 i64, deserialize_u8 visit_u8 u8, deserialize_u16 visit_u16 u16,
        deserialize_u32 visit_u32 u32, deserialize_u64 visit_u64 u64);

    fn deserialize_f32<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        self.deserialize_f64(visitor)
    }
    fn deserialize_f64<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.node.value {
            Value::Number(n) => self.placed(visitor.visit_f64(n)),
            _ => self.unfit(&"a number"),
        }
    }
    fn deserialize_char<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.node.value {
            Value::Char(c) => self.placed(visitor.visit_char(c)),
            _ => self.unfit(&"a character"),
        }
    }
    fn deserialize_str<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match &self.node.value {
            Value::Text(text) => self.placed(visitor.visit_borrowed_str(text)),
            _ => self.unfit(&"a text in quotes"),
        }
    }
    fn deserialize_string<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        self.deserialize_str(visitor)
    }
    fn deserialize_option<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match &self.node.value {
            Value::Word(name) if name == "None" => visitor.visit_none(),
            Value::Tuple(Some(name), items) if name == "Some" && items.len() == 1 => {
                visitor.visit_some(Cursor::of(&items[0]))
            }
            _ => visitor.visit_some(self),
        }
    }
    fn deserialize_unit<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.node.fields() {
            Some([]) => self.placed(visitor.visit_unit()),
            _ => self.unfit(&"()"),
        }
    }
    fn deserialize_unit_struct<V: Visitor<'a>>(self, _: &'static str, visitor: V) -> Result<V::Value, Wrong> {
        self.deserialize_unit(visitor)
    }
    fn deserialize_newtype_struct<V: Visitor<'a>>(self, _: &'static str, visitor: V) -> Result<V::Value, Wrong> {
        visitor.visit_newtype_struct(self)
    }
    fn deserialize_seq<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match &self.node.value {
            Value::List(items) => self.placed(self.seq(items, visitor)),
            Value::Tuple(_, items) if self.name().is_none() => self.placed(self.seq(items, visitor)),
            _ => self.unfit(&"a list [ ]"),
        }
    }
    fn deserialize_tuple<V: Visitor<'a>>(self, len: usize, visitor: V) -> Result<V::Value, Wrong> {
        match &self.node.value {
            Value::Tuple(_, items) | Value::List(items) if self.name().is_none() && items.len() == len => {
                self.placed(self.seq(items, visitor))
            }
            Value::Tuple(_, items) | Value::List(items) if self.name().is_none() => {
                let what = format!("expected {len} values in ( ), found {}", items.len());
                self.placed(Err(Wrong::new(what, Some(format!("write {len} values")))))
            }
            _ => self.unfit(&format!("{len} values in ( )").as_str()),
        }
    }
    fn deserialize_tuple_struct<V: Visitor<'a>>(
        self,
        _: &'static str,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Wrong> {
        self.deserialize_tuple(len, visitor)
    }
    fn deserialize_map<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match &self.node.value {
            Value::Map(items) => self.placed(visitor.visit_map(Entries { left: items.iter(), value: None })),
            _ => self.unfit(&"a map { \"name\": value }"),
        }
    }
    fn deserialize_struct<V: Visitor<'a>>(
        self,
        name: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Wrong> {
        let fields = match &self.node.value {
            Value::Word(_) if self.content => Some([].as_slice()),
            _ => self.node.fields().filter(|_| self.name().is_none_or(|n| n == name)),
        };
        match fields {
            Some(fields) => self.placed(visitor.visit_map(Fields { left: fields.iter(), value: None })),
            None => self.unfit(&format!("({}: …)", known.join(": …, ")).as_str()),
        }
    }
    fn deserialize_enum<V: Visitor<'a>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Wrong> {
        match self.name() {
            Some(_) => self.placed(visitor.visit_enum(self)),
            None => self.unfit(&format!("one of {}", variants.join(", ")).as_str()),
        }
    }
    fn deserialize_identifier<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        self.deserialize_str(visitor)
    }
    fn deserialize_ignored_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Wrong> {
        visitor.visit_unit()
    }
    serde::forward_to_deserialize_any! { <V: Visitor<'a>> i128 u128 bytes byte_buf }
}

fn expectation<'a, V: Visitor<'a>>(visitor: &V) -> String {
    struct Show<'v, V>(&'v V);
    impl<'a, V: Visitor<'a>> fmt::Display for Show<'_, V> {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            self.0.expecting(f)
        }
    }
    Show(visitor).to_string()
}

struct Items<'i, 'a>(&'i mut std::slice::Iter<'a, Node>);

impl<'a> de::SeqAccess<'a> for Items<'_, 'a> {
    type Error = Wrong;
    fn next_element_seed<T: DeserializeSeed<'a>>(&mut self, seed: T) -> Result<Option<T::Value>, Wrong> {
        self.0.next().map(|node| seed.deserialize(Cursor::of(node))).transpose()
    }
}

struct Fields<'a> {
    left: std::slice::Iter<'a, Field>,
    value: Option<&'a Node>,
}

impl<'a> de::MapAccess<'a> for Fields<'a> {
    type Error = Wrong;
    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, Wrong> {
        let Some(field) = self.left.next() else { return Ok(None) };
        self.value = Some(&field.value);
        let key = seed.deserialize(StrDeserializer::<Wrong>::new(&field.name));
        key.map(Some).map_err(|e| e.or_at(&field.source, &field.name_span))
    }
    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Wrong> {
        seed.deserialize(Cursor::of(self.value.take().expect("a key was read")))
    }
}

struct Entries<'a> {
    left: std::slice::Iter<'a, (Node, Node)>,
    value: Option<&'a Node>,
}

impl<'a> de::MapAccess<'a> for Entries<'a> {
    type Error = Wrong;
    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, Wrong> {
        let Some((key, value)) = self.left.next() else { return Ok(None) };
        self.value = Some(value);
        seed.deserialize(Cursor::of(key)).map(Some)
    }
    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Wrong> {
        seed.deserialize(Cursor::of(self.value.take().expect("a key was read")))
    }
}

impl<'a> de::EnumAccess<'a> for Cursor<'a> {
    type Error = Wrong;
    type Variant = Cursor<'a>;
    fn variant_seed<V: DeserializeSeed<'a>>(self, seed: V) -> Result<(V::Value, Cursor<'a>), Wrong> {
        let name = self.name().expect("only what has a name is an enum");
        let span = self.node.span.start..self.node.span.start + name.len();
        let value =
            seed.deserialize(StrDeserializer::<Wrong>::new(name)).map_err(|e| e.or_at(&self.node.source, &span))?;
        Ok((value, Cursor { content: true, ..self }))
    }
}

impl<'a> de::VariantAccess<'a> for Cursor<'a> {
    type Error = Wrong;
    fn unit_variant(self) -> Result<(), Wrong> {
        match &self.node.value {
            Value::Word(_) => Ok(()),
            Value::Tuple(_, items) if items.is_empty() => Ok(()),
            _ => {
                let name = self.node.name().unwrap_or_default();
                self.placed(Err(Wrong::new(
                    format!("`{name}` takes nothing in its brackets"),
                    Some(format!("write {name}")),
                )))
            }
        }
    }
    fn newtype_variant_seed<T: DeserializeSeed<'a>>(self, seed: T) -> Result<T::Value, Wrong> {
        match &self.node.value {
            Value::Tuple(_, items) if items.len() == 1 => seed.deserialize(Cursor::of(&items[0])),
            _ => self.placed(seed.deserialize(self)),
        }
    }
    fn tuple_variant<V: Visitor<'a>>(self, len: usize, visitor: V) -> Result<V::Value, Wrong> {
        self.deserialize_tuple(len, visitor)
    }
    fn struct_variant<V: Visitor<'a>>(self, known: &'static [&'static str], visitor: V) -> Result<V::Value, Wrong> {
        self.deserialize_struct("", known, visitor)
    }
}
