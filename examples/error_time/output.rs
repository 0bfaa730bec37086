//! Writes `error_time.json`, `error_time.md` and the plots.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::curve::Curve;
use crate::support::{Failure, Origin, write_file};
use crate::{figures, tables};

/// Digits of numbers in the JSON.
const DIGITS: usize = 5;

#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    curves: &'a [Curve],
}

/// Writes everything, and the table of best settings to the terminal.
pub fn write(folder: &Path, origin: &Origin, curves: &[Curve]) -> Result<(), Failure> {
    let text = tables::all(origin, curves);
    write_file(&folder.join("error_time.md"), text.as_bytes())?;
    let mut value = serde_json::to_value(File { origin, curves })?;
    round(&mut value);
    write_file(&folder.join("error_time.json"), lines(&value)?.as_bytes())?;
    figures::write(folder, curves)
}

/// Keeps [`DIGITS`] digits of every fraction.
fn round(value: &mut Value) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(round),
        Value::Object(values) => values.values_mut().for_each(round),
        Value::Number(number) if number.is_f64() => {
            let exact = number.as_f64().unwrap_or(f64::NAN);
            let rounded = format!("{exact:.*e}", DIGITS - 1).parse().unwrap_or(exact);
            *value = rounded.into();
        }
        _ => {}
    }
}

/// JSON with a line for every curve.
fn lines(file: &Value) -> Result<String, Failure> {
    let mut head = file.clone();
    let curves = head.as_object_mut().and_then(|head| head.remove("curves"));
    let curves: Vec<String> =
        curves.iter().flat_map(|c| c.as_array()).flatten().map(Value::to_string).collect();
    let head = serde_json::to_string_pretty(&head)?;
    let open = head.trim_end().trim_end_matches('}').trim_end();
    Ok(format!("{open},\n  \"curves\": [\n    {}\n  ]\n}}\n", curves.join(",\n    ")))
}
