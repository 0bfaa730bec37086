//! Markdown tables.

use std::fmt::Write as _;

/// A Markdown table; the first `text` columns are aligned to the left.
pub struct Table {
    text: String,
    empty: bool,
}

impl Table {
    pub fn new(title: &str, heads: &[&str], left: usize) -> Self {
        let rule = (0..heads.len()).map(|i| if i < left { "---" } else { "---:" });
        let rule = rule.collect::<Vec<_>>().join(" | ");
        Self { text: format!("## {title}\n\n| {} |\n| {rule} |\n", heads.join(" | ")), empty: true }
    }

    pub fn line(&mut self, cells: &[String]) {
        self.empty = false;
        // Writing to a String does not fail.
        writeln!(self.text, "| {} |", cells.join(" | ")).unwrap_or_default();
    }

    /// The table and an empty line; nothing without lines.
    pub fn finish(self) -> String {
        if self.empty { String::new() } else { self.text + "\n" }
    }
}
