//! The page's session without a page.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use progressive_iso::{Capture, Infill, Outputs, RendererOptions, Residency, wgpu};
use volume_io::{FixedRateHeader, Geometry};
use web::camera::Orbit;
use web::exchange::Exchange;
use web::session::{Error, Session, Settings, Step};

const SIZE: [u32; 2] = [64, 48];

struct Page {
    device: wgpu::Device,
    queue: wgpu::Queue,
    session: Session,
}

fn file() -> Vec<u8> {
    let field = volumes::by_name("gyroid", [40, 41, 43]).unwrap();
    let volume = volumes::generate(&*field, [40, 41, 43], 8.0).unwrap();
    let mut file = Vec::new();
    volume_io::write_zfp(&volume, &mut file).unwrap();
    file
}

fn settings(residency: Residency) -> Settings {
    let outputs = Outputs { status: true, depth: true, ..Outputs::default() };
    let renderer =
        RendererOptions { size: SIZE, outputs, capture: true, residency, ..Default::default() };
    Settings { renderer, ..Settings::default() }
}

impl Page {
    fn open(file: &[u8], residency: Residency) -> Self {
        let (device, queue) = gpu_testkit::gpu::device();
        let header = FixedRateHeader::parse(file).unwrap();
        let settings = settings(residency);
        let session = Session::new(&device, &queue, header, Geometry::default(), settings).unwrap();
        Self { device, queue, session }
    }

    fn step(&mut self) -> Step {
        let step = self.session.advance(&self.device, &self.queue).unwrap();
        #[expect(clippy::disallowed_methods, reason = "the test owns the loop")]
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        step
    }

    /// Goes on until the session rests; the picture, and the steps that brought something new.
    fn finish(&mut self) -> (Capture, usize) {
        let mut news = 0;
        loop {
            let step = self.step();
            news += usize::from(step.is_new);
            if step.rests {
                let renderer = self.session.renderer();
                return (renderer.capture_blocking(&self.device, &self.queue).unwrap(), news);
            }
        }
    }
}

#[test]
fn what_changes_is_in_the_next_picture_that_rests() {
    let file = file();
    for residency in [Residency::Cached, Residency::Full] {
        let mut page = Page::open(&file, residency);
        for piece in file.chunks(5000) {
            assert!(!page.step().is_new, "nothing is shown before the volume is there");
            page.session.push(piece).unwrap();
        }
        page.session.finish().unwrap();
        let suggested = page.session.isovalue().unwrap();
        let histogram = page.session.histogram().unwrap();
        assert!((histogram.range()[0]..histogram.range()[1]).contains(&suggested));
        let (first, news) = page.finish();
        assert!(news > 0);
        assert_eq!(page.step(), Step { is_new: false, rests: true });

        page.session.set_isovalue(suggested + 0.1);
        assert!(!page.step().rests, "the change is not forgotten");
        let (other, _) = page.finish();
        assert_ne!(other.color, first.color);
        page.session.set_view(Orbit::default().turned(0.1, 0.0));
        assert_ne!(page.finish().0.color, other.color);
        page.session.set_view(Orbit::default());
        page.session.set_isovalue(suggested);
        assert_eq!(page.finish().0, first, "and back again");
        assert_eq!(page.session.passes().last().unwrap().completeness, 1.0);
    }
}

#[test]
fn options_that_are_refused_leave_the_last_ones() {
    let file = file();
    let mut page = Page::open(&file, Residency::Auto);
    page.session.push(&file).unwrap();
    page.session.finish().unwrap();
    let first_settings = *page.session.settings();
    let with = |renderer| Settings { renderer, ..first_settings };
    let options = first_settings.renderer;
    page.session.set(with(RendererOptions { budget_bytes: 1, ..options }));
    let (first, _) = page.finish();
    assert!(page.session.take_refusal().is_some() && page.session.take_refusal().is_none());
    assert_eq!(page.session.settings(), &first_settings);
    page.session.set(with(RendererOptions { size: [32, 24], ..options }));
    assert_eq!(page.finish().0.size, [32, 24]);
    page.session.set(first_settings);
    assert_eq!(page.finish().0, first);
}

#[test]
fn a_frame_rests_at_the_threshold() {
    let file = file();
    let mut page = Page::open(&file, Residency::Cached);
    page.session.push(&file).unwrap();
    page.session.finish().unwrap();
    // So few that a pass does not finish.
    let mut settings = *page.session.settings();
    settings.renderer.most_slots = Some(40);
    for infill in [Infill::Off, Infill::Classical, Infill::Network] {
        page.session.set(Settings { threshold: 0.2, infill, ..settings });
        page.finish();
        let report = *page.session.report();
        assert!(report.completeness() >= 0.2 && report.stopped(), "{report:?}");
        assert_eq!(report.filled_pixels > 0, infill != Infill::Off, "{infill:?}");
        assert_eq!(page.session.is_filled(), infill != Infill::Off);
        page.session.set(settings);
        page.finish();
        assert!(page.session.report().complete());
    }
}

#[test]
fn a_file_that_is_too_short_or_unsafe_is_an_error() {
    let mut bad = file();
    let mut page = Page::open(&bad, Residency::Auto);
    page.session.push(&bad[..1000]).unwrap();
    assert!(matches!(page.session.finish(), Err(Error::File(_))));
    assert!(!page.step().is_new);
    bad[12..14].fill(0xff);
    let mut page = Page::open(&bad, Residency::Auto);
    assert!(matches!(page.session.push(&bad), Err(Error::File(_))));
}

#[test]
fn in_fill_changes_no_finished_picture_and_is_planned_where_it_helps() {
    let file = file();
    let mut pictures = Vec::new();
    for residency in [Residency::Full, Residency::Cached] {
        let mut page = Page::open(&file, residency);
        page.session.push(&file).unwrap();
        page.session.finish().unwrap();
        for infill in [Infill::Network, Infill::Off, Infill::Classical, Infill::Network] {
            let settings = *page.session.settings();
            page.session.set(Settings { infill, ..settings });
            pictures.push(page.finish().0);
            assert!(page.session.take_refusal().is_none());
            let parts = page.session.renderer().plan().parts();
            let planned = parts.iter().any(|part| part.name == "infill" && part.included);
            let expected = residency == Residency::Cached && infill != Infill::Off;
            assert_eq!(planned, expected, "{residency:?} {infill:?}");
            assert_eq!(page.session.infill() != Infill::Off, expected);
        }
    }
    // Normals come with in-fill.
    pictures.iter_mut().for_each(|picture| picture.normal = None);
    assert!(pictures.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn a_smaller_budget_brings_in_fill_and_the_smallest_does_without() {
    let file = file();
    let mut page = Page::open(&file, Residency::Auto);
    page.session.push(&file).unwrap();
    page.session.finish().unwrap();
    let (first, _) = page.finish();
    let settings = *page.session.settings();
    let with = |budget_bytes| {
        let renderer = RendererOptions { budget_bytes, ..settings.renderer };
        Settings { renderer, ..settings }
    };
    assert_eq!(page.session.infill(), Infill::Off, "all is resident");
    let resident = page.session.renderer().plan().bytes();
    page.session.set(with(resident - 1));
    assert!(page.finish().0.color == first.color);
    assert_eq!(page.session.infill(), Infill::Network);
    page.session.set(with(1));
    page.finish();
    let minimum = match page.session.take_refusal() {
        Some(progressive_iso::Error::BudgetTooSmall { minimum, .. }) => minimum,
        other => panic!("{other:?}"),
    };
    page.session.set(with(minimum));
    assert!(page.finish().0.color == first.color);
    assert_eq!((page.session.infill(), page.session.take_refusal()), (Infill::Off, None));
}

/// An exchange that shows `file`, finished.
fn exchange(device: &wgpu::Device, queue: &wgpu::Queue, file: &[u8]) -> Exchange {
    let mut exchange = Exchange::new(settings(Residency::Auto));
    exchange.open(device, queue, file, Geometry::default()).unwrap();
    assert_eq!(exchange.push(file).unwrap(), file.len() as u64);
    exchange.finish().unwrap();
    rest(&mut exchange, device, queue);
    exchange
}

fn rest(exchange: &mut Exchange, device: &wgpu::Device, queue: &wgpu::Queue) -> Capture {
    while !exchange.advance(device, queue).unwrap().rests {
        #[expect(clippy::disallowed_methods, reason = "the test owns the loop")]
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    }
    exchange.shown().unwrap().renderer().capture_blocking(device, queue).unwrap()
}

#[test]
fn a_refused_file_leaves_volume_view_and_settings() {
    let (device, queue) = gpu_testkit::gpu::device();
    let good = file();
    let mut exchange = exchange(&device, &queue, &good);
    exchange.shown_mut().unwrap().set_view(Orbit::default().turned(0.2, 0.1));
    let first = rest(&mut exchange, &device, &queue);
    let before = (*exchange.settings(), exchange.shown().unwrap().view());
    let mut bad = good.clone();
    bad[12..14].fill(0xff);
    let geometry = Geometry::default();
    for stage in ["header", "push", "finish", "given up"] {
        match stage {
            "header" => {
                let found = exchange.open(&device, &queue, &good[1..], geometry);
                assert!(matches!(found, Err(Error::NoFixedRate)));
            }
            "push" => {
                exchange.open(&device, &queue, &bad, geometry).unwrap();
                assert!(matches!(exchange.push(&bad), Err(Error::File(_))));
            }
            "finish" => {
                exchange.open(&device, &queue, &good, geometry).unwrap();
                exchange.push(&good[..1000]).unwrap();
                exchange.advance(&device, &queue).unwrap();
                assert!(matches!(exchange.finish(), Err(Error::File(_))));
            }
            _ => {
                exchange.open(&device, &queue, &good, geometry).unwrap();
                exchange.push(&good).unwrap();
                exchange.advance(&device, &queue).unwrap();
                exchange.give_up();
            }
        }
        assert!(exchange.incoming().is_none(), "{stage}");
        assert_eq!(rest(&mut exchange, &device, &queue), first, "{stage}");
        assert_eq!((*exchange.settings(), exchange.shown().unwrap().view()), before, "{stage}");
    }
    // What goes wrong on the way to the first picture is told once.
    exchange.open(&device, &queue, &good, geometry).unwrap();
    exchange.push(&good).unwrap();
    exchange.finish().unwrap();
    let twice = RendererOptions { budget_bytes: 1, ..exchange.settings().renderer };
    let refused = Settings { renderer: twice, ..*exchange.settings() };
    exchange.set(refused);
    assert_eq!(rest(&mut exchange, &device, &queue).size, SIZE);
    assert!(exchange.take_refusal().is_some() && exchange.take_refusal().is_none());
    assert_eq!(exchange.settings(), &before.0);
    assert!(exchange.take_failure().is_none());
    assert_eq!(exchange.shown().unwrap().view(), Orbit::default(), "the new volume is shown");
}
