//! Pictures to compare: the f64 renderer's and the library's.

use glam::{DMat3, DMat4, DVec3};
use gpu_testkit::picture::Picture;
use gpu_testkit::reference::{self, Ray};
use progressive_iso::{Capture, Shading};

use crate::support::Failure;
use crate::volume::{Scene, Volume};

impl Scene {
    fn pixels(&self) -> impl Iterator<Item = [u32; 2]> {
        let [width, height] = self.size;
        (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]))
    }

    /// The view in f64 on the given samples of the volume, shaded as the library shades it with a
    /// headlight.
    pub fn reference(&self, volume: &Volume, samples: &[f32]) -> Picture {
        let scene = reference::Scene::new(volume.dims, samples, volume.isovalue.into());
        let rays: Vec<Ray> = self
            .pixels()
            .map(|pixel| {
                let (origin, direction, _) = self.view.ray(pixel);
                Ray { origin, direction, t_min: 0.0 }
            })
            .collect();
        let world = DMat3::from_mat4(DMat4::from_cols_array_2d(&volume.world_from_index()));
        let normal_matrix = world.inverse().transpose();
        let shading = &self.frame.options.shading;
        let mut picture = Picture {
            size: self.size,
            color: vec![bytes(shading.background.map(f64::from)); rays.len()],
            depth_voxels: vec![f64::INFINITY; rays.len()],
            normal: vec![[0.0; 3]; rays.len()],
        };
        for (i, trace) in scene.trace_rays(&rays).iter().enumerate() {
            let Some(hit) = trace.hit else { continue };
            let to_viewer = -(world * DVec3::from(rays[i].direction)).normalize();
            let normal = normal_matrix * DVec3::from(hit.gradient);
            let normal = normal.try_normalize().unwrap_or(to_viewer);
            let normal = if normal.dot(to_viewer) < 0.0 { -normal } else { normal };
            picture.depth_voxels[i] = hit.t;
            picture.normal[i] = normal.to_array();
            picture.color[i] = shade(shading, normal.dot(to_viewer));
        }
        picture
    }

    /// What the library shows; unfinished pixels show no surface.
    pub fn shown(&self, capture: &Capture) -> Result<Picture, Failure> {
        let depth = capture.depth.as_ref().ok_or("no depth was captured")?;
        let normal = capture.normal.as_ref().ok_or("no normals were captured")?;
        let voxels = |(pixel, &depth): ([u32; 2], &f32)| {
            let (_, _, depth_per_voxel) = self.view.ray(pixel);
            (f64::from(depth) - self.view.start_depth()) / depth_per_voxel
        };
        Ok(Picture {
            size: self.size,
            color: capture.color.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect(),
            depth_voxels: self.pixels().zip(depth).map(voxels).collect(),
            normal: normal.iter().map(|n| n.map(f64::from)).collect(),
        })
    }
}

/// Blinn-Phong with the light at the viewer: the cosine to the light is also that of the highlight.
fn shade(shading: &Shading, cosine: f64) -> [u8; 3] {
    let [ambient, diffuse, specular, shininess] =
        [shading.ambient, shading.diffuse, shading.specular, shading.shininess].map(f64::from);
    let highlight = specular * cosine.powf(shininess);
    let lit = ambient + diffuse * cosine;
    let [r, g, b] = shading.base_color.map(|base| f64::from(base) * lit + highlight);
    bytes([r, g, b, 1.0])
}

fn bytes([r, g, b, _]: [f64; 4]) -> [u8; 3] {
    [r, g, b].map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}
