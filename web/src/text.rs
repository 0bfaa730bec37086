//! Numbers for people.

use progressive_iso::Category;

/// Bytes in the decimal units that memory sizes on the page are in.
#[must_use]
pub fn bytes(count: u64) -> String {
    let units = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let size = count as f64;
    match units.into_iter().find(|&(unit, _)| size >= 0.9995 * unit) {
        Some((unit, name)) => format!("{} {name}", digits(size / unit)),
        None => format!("{count} B"),
    }
}

/// Three significant digits, but never fewer than the integer part.
fn digits(value: f64) -> String {
    let decimals = if value >= 99.95 { 0 } else { 1 + usize::from(value < 9.995) };
    format!("{value:.decimals$}")
}

/// A count with thin spaces between groups of three digits.
#[must_use]
pub fn count(value: u64) -> String {
    let text = value.to_string();
    let mut grouped = String::new();
    for (position, digit) in text.chars().enumerate() {
        if position > 0 && (text.len() - position).is_multiple_of(3) {
            grouped.push('\u{2009}');
        }
        grouped.push(digit);
    }
    grouped
}

/// A share as a percentage that says 100 only when nothing is missing.
#[must_use]
pub fn percent(share: f64) -> String {
    if share >= 1.0 { "100 %".into() } else { format!("{:.1} %", (1e3 * share).floor() / 10.0) }
}

/// Milliseconds, or seconds where there are thousands.
#[must_use]
pub fn milliseconds(ms: f64) -> String {
    if ms >= 9_995.0 {
        format!("{:.1} s", ms / 1e3)
    } else if ms >= 9.95 {
        format!("{ms:.0} ms")
    } else {
        format!("{ms:.1} ms")
    }
}

/// What a kind of memory is for, in the words of the page; several kinds share a name.
#[must_use]
pub fn purpose(category: Category) -> &'static str {
    match category {
        Category::Payload => "compressed volume",
        Category::Ranges | Category::Masks => "value ranges",
        Category::Slots | Category::Directory => "decoded blocks",
        Category::Rays => "rays",
        Category::Outputs => "pictures",
        _ => "staging",
    }
}

/// Bytes by purpose, largest first.
#[must_use]
pub fn by_purpose(categories: &[(Category, u64)]) -> Vec<(&'static str, u64)> {
    let mut sums: Vec<(&'static str, u64)> = Vec::new();
    for &(category, bytes) in categories {
        let name = purpose(category);
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += bytes,
            None => sums.push((name, bytes)),
        }
    }
    sums.retain(|&(_, sum)| sum > 0);
    sums.sort_by_key(|&(_, sum)| std::cmp::Reverse(sum));
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_three_digits() {
        let expected = [
            (0, "0 B"),
            (999, "999 B"),
            (1000, "1.00 kB"),
            (4_456_280, "4.46 MB"),
            (57_678_816, "57.7 MB"),
            (268_435_456, "268 MB"),
            (999_600, "1.00 MB"),
            (9_999_000, "10.0 MB"),
            (99_960_000, "100 MB"),
            (1 << 31, "2.15 GB"),
        ];
        for (value, text) in expected {
            assert_eq!(bytes(value), text);
        }
    }

    #[test]
    fn counts_are_grouped() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(139_258), "139\u{2009}258");
        assert_eq!(count(1_000_000), "1\u{2009}000\u{2009}000");
    }

    #[test]
    fn a_hundred_per_cent_is_all() {
        assert_eq!(percent(1.0), "100 %");
        assert_eq!(percent(0.999_999), "99.9 %");
        assert_eq!(percent(0.8549), "85.4 %");
        assert_eq!(percent(0.0), "0.0 %");
    }

    #[test]
    fn times_change_their_unit() {
        assert_eq!(milliseconds(1.26), "1.3 ms");
        assert_eq!(milliseconds(432.1), "432 ms");
        assert_eq!(milliseconds(12_345.0), "12.3 s");
    }

    #[test]
    fn purposes_add_up() {
        let all: Vec<_> = Category::ALL.into_iter().zip(1u64..).collect();
        let sums = by_purpose(&all);
        assert_eq!(sums.iter().map(|s| s.1).sum::<u64>(), all.iter().map(|c| c.1).sum::<u64>());
        assert!(sums.windows(2).all(|pair| pair[0].1 >= pair[1].1));
        assert!(by_purpose(&[(Category::Rays, 0)]).is_empty());
    }
}
