//! The figures of a scale: five by seven pixels each.

use crate::image::Image;

/// Rows from the top; the leftmost pixel is the highest of five bits.
const FIGURES: [(char, [u8; 7]); 15] = [
    ('0', [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110]),
    ('1', [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110]),
    ('2', [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111]),
    ('3', [0b11111, 0b00010, 0b00100, 0b00010, 0b00001, 0b10001, 0b01110]),
    ('4', [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010]),
    ('5', [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110]),
    ('6', [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110]),
    ('7', [0b11111, 0b00001, 0b00010, 0b00100, 0b00100, 0b01000, 0b01000]),
    ('8', [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110]),
    ('9', [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100]),
    ('.', [0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100]),
    ('-', [0b00000, 0b00000, 0b00000, 0b11111, 0b00000, 0b00000, 0b00000]),
    ('+', [0b00000, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0b00000]),
    ('e', [0b00000, 0b00000, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110]),
    ('%', [0b11001, 0b11001, 0b00010, 0b00100, 0b01000, 0b10011, 0b10011]),
];

pub(super) const HEIGHT: u32 = 7;

/// Pixels from one figure to the next.
pub(super) const ADVANCE: u32 = 6;

/// Writes `text` with its top left pixel at (x, y), each pixel of a figure `size` wide. What lies outside of the image is
/// cut off.
pub(super) fn write(image: &mut Image, text: &str, (x, y): (u32, u32), size: u32, colour: [f32; 3]) {
    for (n, letter) in text.chars().enumerate() {
        let (_, rows) = FIGURES.iter().find(|(known, _)| *known == letter).expect("a scale is made of these figures");
        for (row, bits) in rows.iter().enumerate() {
            for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
                let (left, top) = (x + size * (ADVANCE * n as u32 + column), y + size * row as u32);
                for (px, py) in (0..size * size).map(|k| (left + k % size, top + k / size)) {
                    if px < image.width && py < image.height {
                        image.pixels[(py * image.width + px) as usize] = colour;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_figures_look_alike_and_text_lands_where_it_is_put() {
        for (i, (a, first)) in FIGURES.iter().enumerate() {
            for (b, second) in &FIGURES[i + 1..] {
                let apart: u32 = first.iter().zip(second).map(|(p, q)| (p ^ q).count_ones()).sum();
                assert!(apart >= 2, "{a} and {b}");
            }
        }
        let mut image = Image::filled(16, 9, [0.0; 3]);
        write(&mut image, "1-", (1, 1), 1, [1.0; 3]);
        let row = |y: u32| (0..16).map(|x| if image.at(x, y)[0] > 0.0 { '#' } else { ' ' }).collect::<String>();
        assert_eq!([row(0), row(1), row(4)], ["                ", "   #            ", "   #   #####    "]);
        assert_eq!(row(7), "  ###           ");
        // Twice the size is twice the pixels each way, and what does not fit is cut.
        let mut large = Image::filled(16, 9, [0.0; 3]);
        write(&mut large, "11", (1, 1), 2, [1.0; 3]);
        assert_eq!((large.at(5, 1)[0], large.at(6, 2)[0], large.at(4, 2)[0]), (1.0, 1.0, 0.0));
    }
}
