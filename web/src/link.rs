//! The part of the page's address behind `#`: which volume, which isovalue, which view.

use progressive_iso::Infill;

use crate::camera::Orbit;

/// What a link restores. What is left out is the page's choice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Link {
    /// Address of the volume, absolute or relative to the page.
    pub volume: Option<String>,
    /// Value of the surface.
    pub isovalue: Option<f32>,
    /// The camera.
    pub view: Option<Orbit>,
    /// What unfinished pixels show.
    pub infill: Option<Infill>,
}

/// The names of the kinds of in-fill, in links and on the page.
const INFILLS: [(&str, Infill); 3] =
    [("off", Infill::Off), ("classical", Infill::Classical), ("network", Infill::Network)];

/// The kind of in-fill with this name.
#[must_use]
pub fn infill_named(name: &str) -> Option<Infill> {
    INFILLS.into_iter().find(|&(known, _)| known == name).map(|(_, infill)| infill)
}

/// The name of a kind of in-fill.
#[must_use]
pub fn infill_name(infill: Infill) -> &'static str {
    INFILLS.into_iter().find(|&(_, known)| known == infill).map_or("off", |(name, _)| name)
}

impl Link {
    /// Reads a fragment, with or without its `#`. What cannot be read is left out.
    #[must_use]
    pub fn parse(fragment: &str) -> Self {
        let mut link = Self::default();
        for part in fragment.trim_start_matches('#').split('&') {
            match part.split_once('=') {
                Some(("volume", text)) => link.volume = decoded(text).filter(|v| !v.is_empty()),
                Some(("iso", text)) => {
                    link.isovalue = text.parse().ok().filter(|v: &f32| v.is_finite());
                }
                Some(("view", text)) => link.view = view(text),
                Some(("infill", text)) => link.infill = infill_named(text),
                _ => {}
            }
        }
        link
    }

    /// The fragment, without `#`.
    #[must_use]
    pub fn format(&self) -> String {
        let mut parts = Vec::new();
        parts.extend(self.volume.as_ref().map(|volume| format!("volume={}", encoded(volume))));
        parts.extend(self.isovalue.map(|isovalue| format!("iso={isovalue}")));
        parts.extend(self.view.map(|view| {
            let Orbit { azimuth, elevation, distance, target: [x, y, z] } = view;
            format!("view={azimuth},{elevation},{distance},{x},{y},{z}")
        }));
        parts.extend(self.infill.map(|infill| format!("infill={}", infill_name(infill))));
        parts.join("&")
    }
}

fn view(text: &str) -> Option<Orbit> {
    let numbers: Vec<f64> = text.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
    let [azimuth, elevation, distance, x, y, z] = numbers[..] else { return None };
    let finite = numbers.iter().all(|n| n.is_finite());
    finite.then(|| Orbit { azimuth, elevation, distance, target: [x, y, z] }.settled())
}

/// Percent-encoded, but for what addresses are full of and fragments allow.
fn encoded(text: &str) -> String {
    let mut result = String::new();
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/:?@,;".contains(&byte) {
            result.push(byte.into());
        } else {
            result += &format!("%{byte:02X}");
        }
    }
    result
}

/// None if the text is not percent-encoded UTF-8.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&byte, tail)) = rest.split_first() {
        rest = tail;
        if byte == b'%' {
            let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &rest[2..];
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link() -> Link {
        Link {
            volume: Some("https://example.org/a b/\u{fc}.nii.gz?x=1&y=2#z".into()),
            isovalue: Some(0.1),
            view: Some(Orbit { azimuth: -12.3456, ..Orbit::default().moved(0.1, -0.2) }),
            infill: Some(Infill::Classical),
        }
    }

    #[test]
    fn a_link_is_read_as_it_was_written() {
        for link in [
            link(),
            Link::default(),
            Link { volume: None, ..link() },
            Link { isovalue: Some(-1e-20), view: None, ..link() },
            Link { infill: Some(Infill::Off), ..link() },
            Link { infill: Some(Infill::Network), ..Link::default() },
        ] {
            assert_eq!(Link::parse(&link.format()), link, "{}", link.format());
            assert_eq!(Link::parse(&format!("#{}", link.format())), link);
        }
        assert!(!link().format()[7..].contains('#'));
        assert_eq!(link().format().matches('&').count(), 3);
    }

    #[test]
    fn every_view_of_the_page_survives_exactly() {
        let mut view = Orbit::default();
        for step in 0..500 {
            view = view.turned(0.0137, 0.0011 * f64::from(step)).moved(0.003, -0.001).zoomed(1.003);
            let link = Link { view: Some(view), ..Link::default() };
            assert_eq!(Link::parse(&link.format()), link);
        }
    }

    #[test]
    fn what_cannot_be_read_is_left_out() {
        for text in [
            "",
            "#",
            "nonsense",
            "iso=",
            "iso=NaN",
            "iso=inf",
            "iso=1e99",
            "view=1,2,3",
            "view=1,2,3,4,5,x",
            "view=1,2,3,4,5,NaN",
            "volume=",
            "volume=%",
            "volume=%f",
            "volume=%zz",
            "volume=%ff",
            "infill=all",
            "other=3&=&&",
        ] {
            assert_eq!(Link::parse(text), Link::default(), "{text}");
        }
        // Out of range: brought into it.
        let view = Link::parse("view=720,900,-3,0,0,99").view.unwrap();
        assert_eq!(view, view.settled());
    }
}
