//! The page's session without a page.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use progressive_iso::{Capture, Outputs, RendererOptions, Residency, wgpu};
use volume_io::{FixedRateHeader, Geometry};
use web::camera::Orbit;
use web::session::{Error, Session, Step};

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

impl Page {
    fn open(file: &[u8], residency: Residency) -> Self {
        let (device, queue) = gpu_testkit::gpu::device();
        let outputs = Outputs { status: true, depth: true, ..Outputs::default() };
        let options =
            RendererOptions { size: SIZE, outputs, capture: true, residency, ..Default::default() };
        let header = FixedRateHeader::parse(file).unwrap();
        let session = Session::new(&device, &queue, header, Geometry::default(), options).unwrap();
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
    let options = *page.session.options();
    page.session.set_options(RendererOptions { budget_bytes: 1, ..options });
    let (first, _) = page.finish();
    assert!(page.session.take_refusal().is_some() && page.session.take_refusal().is_none());
    assert_eq!(page.session.options(), &options);
    page.session.set_options(RendererOptions { size: [32, 24], ..options });
    assert_eq!(page.finish().0.size, [32, 24]);
    page.session.set_options(options);
    assert_eq!(page.finish().0, first);
}

#[test]
fn a_frame_rests_at_the_threshold() {
    let file = file();
    let mut page = Page::open(&file, Residency::Cached);
    page.session.push(&file).unwrap();
    page.session.finish().unwrap();
    page.session.set_threshold(0.2);
    page.finish();
    let completeness = page.session.report().completeness();
    assert!(completeness >= 0.2, "{completeness}");
    page.session.set_threshold(1.0);
    page.finish();
    assert!(page.session.report().complete());
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
