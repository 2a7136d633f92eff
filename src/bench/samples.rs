//! Every value that was measured, one a row: `samples.csv`.

use std::fmt::Write;

pub const HEADER: &str = "scene,technique,settings,size,measure,unit,repeat,value";

/// What was measured: a technique with its settings, on a scene, at a size.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Subject {
    /// The stem of the scene's file.
    pub scene: String,
    /// `LongRange`
    pub technique: String,
    /// What stands in its brackets: `layers: 8`, or nothing.
    pub settings: String,
    /// `960x540`
    pub size: String,
}

impl Subject {
    /// `LongRange(layers: 8)`
    pub fn words(&self) -> String {
        format!("{}({})", self.technique, self.settings)
    }
}

/// One measured value.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    pub subject: Subject,
    /// `frame`, `pass:frame.gbuffer`, `relmse@volume`.
    pub measure: String,
    /// `ms`, `bytes`, or 1 of what has none.
    pub unit: &'static str,
    /// From 1 on.
    pub repeat: u32,
    pub value: f64,
}

const UNITS: [&str; 3] = ["ms", "bytes", "1"];

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples(pub Vec<Sample>);

impl Samples {
    /// The values of a measure, in the order in which they were measured.
    pub fn values(&self, subject: &Subject, measure: &str) -> impl Iterator<Item = f64> {
        let of = move |sample: &&Sample| sample.measure == measure && sample.subject == *subject;
        self.0.iter().filter(of).map(|sample| sample.value)
    }

    pub fn value(&self, subject: &Subject, measure: &str) -> Option<f64> {
        self.values(subject, measure).next()
    }

    /// Once each, in order.
    pub fn subjects(&self) -> Vec<&Subject> {
        let mut subjects: Vec<&Subject> = self.0.iter().map(|sample| &sample.subject).collect();
        subjects.sort();
        subjects.dedup();
        subjects
    }

    /// The measures of a subject, once each, in order.
    pub fn measures(&self, subject: &Subject) -> Vec<&str> {
        let own = self.0.iter().filter(|sample| sample.subject == *subject);
        let mut measures: Vec<&str> = own.map(|sample| sample.measure.as_str()).collect();
        measures.sort_unstable();
        measures.dedup();
        measures
    }

    /// The text of `samples.csv`.
    pub fn csv(&self) -> String {
        let mut text = format!("{HEADER}\n");
        for Sample { subject, measure, unit, repeat, value } in &self.0 {
            let Subject { scene, technique, settings, size } = subject;
            for field in [scene, technique, settings, size, measure] {
                text += &quoted(field);
                text.push(',');
            }
            writeln!(text, "{unit},{repeat},{value}").expect("a text takes any line");
        }
        text
    }

    /// What [`Samples::csv`] wrote; else the line, 1-based, and what is wrong with it.
    pub fn read(text: &str) -> Result<Samples, (usize, String)> {
        let mut records = records(text)?.into_iter();
        match records.next() {
            Some((_, head)) if head.join(",") == HEADER => {}
            _ => return Err((1, format!("the columns are not {HEADER}"))),
        }
        let sample = |(line, fields): Fields| {
            let count = fields.len();
            let Ok([scene, technique, settings, size, measure, unit, repeat, value]) = <[String; 8]>::try_from(fields)
            else {
                return Err((line, format!("{count} fields, not 8")));
            };
            let unit = UNITS.into_iter().find(|known| *known == unit);
            let unit = unit.ok_or_else(|| (line, format!("the unit is none of {}", UNITS.join(", "))))?;
            let repeat = repeat.parse().map_err(|_| (line, format!("`{repeat}` is no number of a repetition")))?;
            let value = value.parse().map_err(|_| (line, format!("`{value}` is no number")))?;
            Ok(Sample { subject: Subject { scene, technique, settings, size }, measure, unit, repeat, value })
        };
        records.map(sample).collect::<Result<_, _>>().map(Samples)
    }
}

/// A field as it stands between commas.
fn quoted(field: &str) -> String {
    match field.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field.to_string(),
    }
}

/// The line on which a record begins, 1-based, and its fields.
type Fields = (usize, Vec<String>);

/// Every record of a text.
fn records(text: &str) -> Result<Vec<Fields>, (usize, String)> {
    let mut records = Vec::new();
    let mut letters = text.chars().peekable();
    let (mut line, mut begins) = (1, 1);
    let (mut fields, mut field) = (Vec::new(), String::new());
    while let Some(letter) = letters.next() {
        match letter {
            '"' if field.is_empty() => loop {
                match letters.next() {
                    Some('"') if letters.next_if_eq(&'"').is_some() => field.push('"'),
                    Some('"') => break,
                    Some(inside) => {
                        line += usize::from(inside == '\n');
                        field.push(inside);
                    }
                    None => return Err((begins, "the quotation marks are not closed".into())),
                }
            },
            ',' => fields.push(std::mem::take(&mut field)),
            '\r' => {}
            '\n' => {
                fields.push(std::mem::take(&mut field));
                records.push((begins, std::mem::take(&mut fields)));
                line += 1;
                begins = line;
            }
            letter => field.push(letter),
        }
    }
    match fields.is_empty() && field.is_empty() {
        true => Ok(records),
        false => Err((begins, "the last line is not whole".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{sample, subject};
    use super::*;

    #[test]
    fn what_is_written_is_read_again_to_the_last_bit() {
        let plain = subject("Opaque", "");
        let odd = subject("LongRange", "layers: 8, name: \"a\nb\"");
        let samples = Samples(vec![
            sample(&plain, "frame", 1, 0.1 + 0.2),
            sample(&odd, "relmse@volume", 1, -1e-17),
            sample(&odd, "bias@volume", 1, f64::INFINITY),
        ]);
        let text = samples.csv();
        assert!(text.starts_with(&format!("{HEADER}\nball,Opaque,,32x32,frame,ms,1,0.30000000000000004\n")));
        assert!(text.contains("LongRange,\"layers: 8, name: \"\"a\nb\"\"\",32x32,"));
        assert_eq!(Samples::read(&text).unwrap(), samples);
        assert_eq!(Samples::read(&text.replace('\n', "\r\n").replace("a\r\nb", "a\nb")).unwrap(), samples);
        assert_eq!(samples.subjects(), [&odd, &plain]);
        assert_eq!(samples.measures(&odd), ["bias@volume", "relmse@volume"]);
    }

    #[test]
    fn what_is_no_such_table_is_refused_at_its_line() {
        let row = "ball,Opaque,,32x32,frame,ms,1,0.5\n";
        for (text, line, says) in [
            ("".to_string(), 1, "columns"),
            ("a,b\n".into(), 1, "columns"),
            (format!("{HEADER}\n{row}ball,Opaque\n"), 3, "2 fields"),
            (format!("{HEADER}\n{}", row.replace("0.5", "x")), 2, "`x`"),
            (format!("{HEADER}\n{}", row.replace("ms", "hours")), 2, "unit"),
            (format!("{HEADER}\n{row}\"ball"), 3, "not closed"),
            // A row of which only a part was written.
            (format!("{HEADER}\n{row}ball,Opaq"), 3, "not whole"),
        ] {
            let (at, what) = Samples::read(&text).unwrap_err();
            assert!(at == line && what.contains(says), "{at}: {what}");
        }
    }
}
