//! The code that computes a bake is part of the bake's name, so that nobody has to remember to raise a version number.

include!(concat!(env!("OUT_DIR"), "/code.rs"));

/// A name for the text of all source files whose path begins with one of `prefixes` (`src/optics/`), and for the
/// versions of the numerical crates.
pub fn fingerprint(prefixes: &[&str]) -> [u8; 32] {
    let mut hash = blake3::Hasher::new();
    hash.update(CRATES.as_bytes());
    for prefix in prefixes {
        let mut found = false;
        for (_, content) in FILES.iter().filter(|(path, _)| path.starts_with(prefix)) {
            hash.update(content);
            found = true;
        }
        assert!(found, "no source file begins with {prefix}: a bake names code that is not there");
    }
    *hash.finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_code_other_name() {
        assert_ne!(fingerprint(&["src/store/key.rs"]), fingerprint(&["src/store/code.rs"]));
        assert_ne!(fingerprint(&["src/store/"]), fingerprint(&["src/store/key.rs"]));
        assert!(CRATES.contains("glam") && CRATES.contains("obvhs"));
    }

    #[test]
    #[should_panic(expected = "not there")]
    fn code_that_is_not_there_is_a_mistake() {
        fingerprint(&["src/store/nothing.rs"]);
    }
}
