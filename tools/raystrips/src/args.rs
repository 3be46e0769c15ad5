//! The flags, as typed.

use crate::units::{parse_count, parse_size};
use clap::{Args, Parser, Subcommand, ValueEnum};
use raystrips_convert::{ConvertParams, ImportOptions, Layout, PackProxies, Positions};
use raystrips_render::{MAX_GATHER_RAYS, ToneCurve};
use std::path::PathBuf;

/// Ray traces triangle meshes far larger than memory, at full detail.
///
/// Models (OBJ, glTF, PLY, hair) and scenes (scene.toml) are converted to packs of Ray-Strips, some 9 bytes a
/// triangle, which are then rendered or queried.
#[derive(Parser, Debug)]
#[command(name = "raystrips", version, max_term_width = 100)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Convert models or a scene to a pack.
    Convert(ConvertArgs),
    /// Simplify models or a scene to a mesh of fewer triangles.
    Proxy(ProxyArgs),
    /// Render a picture of a pack, a model or a scene.
    Render(RenderArgs),
    /// Trace a file of rays through a pack.
    Trace(TraceArgs),
    /// Tell what is in a pack.
    Info(InfoArgs),
    /// Read all of a pack and check it.
    ///
    /// Exits with status 1 and names the page where it is damaged.
    Verify(VerifyArgs),
}

/// How a conversion is done.
#[derive(Args, Debug, Clone)]
pub struct ConvertOptions {
    /// Bytes of a page, the unit of reading: 4K to 512K.
    #[arg(long, value_name = "SIZE", default_value = "64K", value_parser = parse_page_size)]
    pub page_size: u32,

    /// Order of pages, nodes and vertices. The picture is the same with all of them.
    #[arg(long, value_enum, default_value_t = LayoutName::DepthFirst)]
    pub layout: LayoutName,

    /// Keep the number that each triangle has in the input (4 or 8 bytes a triangle), so that `trace` can tell
    /// it.
    #[arg(long)]
    pub keep_ids: bool,

    /// Longest strip in windows of six triangles, 1 to 42.
    ///
    /// Longer strips make a smaller pack and slower rays.
    #[arg(long, value_name = "WINDOWS", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=42))]
    pub strip_windows: u8,

    /// Keep positions as they are (exact), or on one grid for the whole scene (grid, or grid:BITS for other than 16
    /// bits along its longest side). A grid makes a smaller pack; `info` tells how far vertices were moved.
    #[arg(long, value_name = "exact|grid[:BITS]", default_value = "exact", value_parser = parse_positions)]
    pub positions: Positions,

    /// Put no proxies into the pack: meshes of fewer triangles, by which rays are ordered where a scene is larger than
    /// memory. Converts in half of the time.
    #[arg(long)]
    pub no_proxy: bool,

    /// Triangles of the proxy as a share of those of the scene.
    #[arg(long, value_name = "SHARE", default_value_t = 0.02, value_parser = parse_ratio)]
    pub proxy_ratio: f64,

    /// Most bytes of the proxy.
    #[arg(long, value_name = "SIZE", default_value = "64M", value_parser = parse_size)]
    pub proxy_memory: u64,

    /// Repeat what glTF and scene files show many times, which is stored once otherwise: larger, and somewhat faster to
    /// trace, with proxies.
    #[arg(long)]
    pub no_instances: bool,

    /// How models are read.
    #[command(flatten)]
    pub source: SourceOptions,
}

impl ConvertOptions {
    /// What proxies to put into the pack.
    pub fn proxies(&self) -> Option<PackProxies> {
        (!self.no_proxy).then_some(PackProxies { ratio: self.proxy_ratio, memory: self.proxy_memory })
    }
}

/// How models are read and worked on.
#[derive(Args, Debug, Clone)]
pub struct SourceOptions {
    /// Leave out triangles that name vertices that do not exist, and count them, instead of refusing the file.
    #[arg(long)]
    pub drop_out_of_range: bool,

    /// Width of lines (OBJ, glTF) and of hair, in units of the file: makes strands of lines, which are left out
    /// otherwise.
    #[arg(long, value_name = "WIDTH", value_parser = parse_width)]
    pub strand_width: Option<f64>,

    /// Leave out textures, and normals, texture coordinates and colors of vertices: the pack has nothing but its surface.
    #[arg(long)]
    pub bare: bool,

    /// Memory to keep to, like 512M or 4G; by default half of what is free.
    ///
    /// It bounds the whole process. What does not fit goes to scratch files. The result is the same.
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory: Option<u64>,

    /// Folder for scratch files; by default one beside the output.
    #[arg(long, value_name = "DIR")]
    pub scratch: Option<PathBuf>,

    /// Begin anew where an interrupted run could go on.
    #[arg(long)]
    pub restart: bool,
}

impl SourceOptions {
    /// Parameters with these and all others as they are by default.
    pub fn params(&self) -> ConvertParams {
        ConvertParams {
            import: ImportOptions {
                drop_out_of_range: self.drop_out_of_range,
                strand_width: self.strand_width,
                bare: self.bare,
                ..ImportOptions::default()
            },
            memory: self.memory,
            scratch: self.scratch.clone(),
            restart: self.restart,
            ..ConvertParams::default()
        }
    }
}

/// Flags of `convert`.
#[derive(Args, Debug)]
pub struct ConvertArgs {
    /// Models (.obj, .gltf, .glb, .ply, .hair), all placed at the origin, or one scene (.toml).
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,

    /// The pack to write.
    #[arg(short, long, value_name = "OUT.rsp")]
    pub output: PathBuf,

    /// How to convert.
    #[command(flatten)]
    pub options: ConvertOptions,

    /// Threads; 0 takes all processors.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,

    /// Print one JSON object about the pack.
    #[arg(long)]
    pub json: bool,
}

/// Names of curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CurveName {
    /// Bits by turns: fast.
    Z,
    /// From neighbor to neighbor.
    Hilbert,
}

/// Orders of what is in a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LayoutName {
    /// Pages and nodes depth first, vertices by first use.
    DepthFirst,
    /// Pages and nodes level by level.
    BreadthFirst,
    /// Pages and nodes by halves of the levels.
    VanEmdeBoas,
    /// Pages and nodes by clusters of probable ones, vertices near their neighbors at every scale.
    CacheOblivious,
    /// Pages and vertices along a Morton curve.
    Morton,
    /// Pages and vertices along a Hilbert curve.
    Hilbert,
    /// Pages and vertices at random, for comparison.
    Random,
}

impl LayoutName {
    /// What it stands for.
    pub fn layout(self) -> Layout {
        match self {
            LayoutName::DepthFirst => Layout::DepthFirst,
            LayoutName::BreadthFirst => Layout::BreadthFirst,
            LayoutName::VanEmdeBoas => Layout::VanEmdeBoas,
            LayoutName::CacheOblivious => Layout::CacheOblivious,
            LayoutName::Morton => Layout::Morton,
            LayoutName::Hilbert => Layout::Hilbert,
            LayoutName::Random => Layout::Random,
        }
    }
}

/// What finds where rays probably hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum HitProxyName {
    /// The smallest proxy of the pack: it fits the processor's cache.
    Coarse,
    /// The largest.
    Fine,
    /// None: boxes of geometries alone.
    None,
}

/// Orders of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ReorderName {
    /// None where the pack fits in memory, else queues.
    Auto,
    /// As they come. Of a pack that does not fit in memory, pages are read when rays need them.
    None,
    /// Rays wait for pages of the pack, as many of which are in memory as --memory allows.
    Queues,
    /// Rays wait for chunks of 32 MiB, as of Pharr et al. 1997.
    Chunks,
    /// Generations of rays sorted by where they begin.
    Origin,
    /// The same, and where they go.
    OriginDir,
    /// Generations of rays sorted by where they probably hit, as of Moon et al. 2010.
    Hph,
    /// The same, and where they go.
    HphDir,
    /// The same, and where they begin.
    HphOrigin,
}

/// Flags of `proxy`.
#[derive(Args, Debug)]
pub struct ProxyArgs {
    /// Models (.obj, .gltf, .glb, .ply, .hair), all placed at the origin, or one scene (.toml).
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,

    /// The mesh to write: .ply, .obj or .glb; strands of hair as .hair or .obj.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,

    /// Triangles to keep, as a share of those of the input.
    #[arg(long, value_name = "SHARE", default_value_t = 0.02, value_parser = parse_ratio)]
    pub ratio: f64,

    /// Triangles to keep, as a number like 20000, 200K or 2M.
    #[arg(long, value_name = "N", conflicts_with = "ratio", value_parser = parse_count)]
    pub triangles: Option<u64>,

    /// How to simplify.
    #[arg(long, value_enum, default_value_t = MethodName::Auto)]
    pub method: MethodName,

    /// Tell how far the surfaces are apart: mean, root of the mean square, and maximum, both ways.
    #[arg(long)]
    pub measure: bool,

    /// How models are read.
    #[command(flatten)]
    pub source: SourceOptions,

    /// Threads; 0 takes all processors.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,

    /// Print one JSON object about the mesh.
    #[arg(long)]
    pub json: bool,
}

/// How a mesh is simplified.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodName {
    /// Quadric, but stochastic where most of the model is many small parts, as foliage is.
    Auto,
    /// Collapse edges, those of least error first.
    Quadric,
    /// Leave out parts and let the others grow.
    Stochastic,
}

/// How light is computed.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorName {
    /// Path tracing: light from lamps, emissive surfaces and the sky, with all its bounces.
    Path,
    /// Photon mapping: the same light, with clear caustics below glass and mirrors.
    Photon,
    /// Ambient occlusion: how open each place is.
    Ao,
    /// Direction of the surface as a color.
    Normal,
}

/// Tone curves.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneName {
    /// As they are, with highlights compressed: colors keep their hue.
    Neutral,
    /// AgX: little contrast, highlights fade to white as on film.
    Agx,
    /// ACES: much contrast.
    Aces,
    /// Cut at 1.
    Clip,
}

impl ToneName {
    /// What it stands for.
    pub fn curve(self) -> ToneCurve {
        match self {
            ToneName::Neutral => ToneCurve::Neutral,
            ToneName::Agx => ToneCurve::Agx,
            ToneName::Aces => ToneCurve::Aces,
            ToneName::Clip => ToneCurve::Clip,
        }
    }
}

/// Flags of `render`.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// A pack (.rsp), or a model or scene that is converted first and kept in a cache folder.
    pub input: PathBuf,

    /// The picture to write: .exr (linear, with albedo, normal and depth) or .png.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,

    /// How light is computed.
    #[arg(long, value_enum, default_value = "path")]
    pub integrator: IntegratorName,

    /// Samples a pixel.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: u32,

    /// Width and height of the picture.
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = parse_picture_size)]
    pub size: (u32, u32),

    /// A camera of the file by name or number (0 is the first), or
    /// "px,py,pz,tx,ty,tz[,fov]": position, target and vertical field of view in degrees.
    #[arg(long, value_name = "CAMERA", allow_hyphen_values = true)]
    pub camera: Option<String>,

    /// Bounces of a path.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub bounces: u32,

    /// Photons sent out in a pass, with the photon integrator. Those of one pass alone are in memory.
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub photons: u64,

    /// Passes, each with photons of its own, that share the samples of a pixel.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    pub photon_passes: u32,

    /// Photons of an estimate: more make it smoother.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub photons_nearest: u32,

    /// Rays that gather light at each surface seen. Samples have one each already; more are for smoother pictures with
    /// few samples.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_GATHER_RAYS)))]
    pub gather_rays: u32,

    /// Light from all around instead of the sky of the scene: a picture of all directions (.hdr or .exr, twice as wide as
    /// high), whose middle is towards -z and whose upper border is +y. Lamps of the scene stay.
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,

    /// Turn that picture about +y, counter-clockwise as seen from above.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_hyphen_values = true, value_parser = parse_angle)]
    pub env_rotation: f32,

    /// Make that picture so many times as bright.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = parse_strength)]
    pub env_strength: f32,

    /// Exposure of a PNG: each step doubles the light.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true)]
    pub exposure: f32,

    /// How values beyond the range of a screen are treated in a PNG [default: neutral for light, clip for others].
    #[arg(long, value_enum, value_name = "CURVE")]
    pub tone: Option<ToneName>,

    /// In which order rays are traced. It changes the time, never the picture.
    #[arg(long, value_enum, value_name = "ORDER", default_value = "auto")]
    pub reorder: ReorderName,

    /// The curve along which rays are sorted, for orders that sort.
    #[arg(long, value_enum, value_name = "CURVE", default_value = "z")]
    pub curve: CurveName,

    /// What finds where rays probably hit, for orders that ask for that.
    #[arg(long, value_enum, value_name = "PROXY", default_value = "coarse")]
    pub hit_proxy: HitProxyName,

    /// Memory for rays that are to be sorted; by default a part of --memory.
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub ray_buffer: Option<u64>,

    /// Another number gives other noise; the same one always the same picture, bit for bit.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Threads; 0 takes all processors.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,

    /// Keep what is done every so many seconds in OUT.unfinished. An interrupted run goes on from there; --restart begins
    /// anew.
    #[arg(long, value_name = "SECONDS", default_value_t = 300)]
    pub keep_every: u64,

    /// Write counts and times as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,

    /// Where packs of models are kept [default: raystrips in the user's cache folder].
    #[arg(long, value_name = "FOLDER")]
    pub cache: Option<PathBuf>,

    /// How to convert, if INPUT is not a pack.
    #[command(flatten)]
    pub convert: ConvertOptions,
}

/// Flags of `trace`.
#[derive(Args, Debug)]
pub struct TraceArgs {
    /// The pack.
    pub pack: PathBuf,

    /// Rays: little-endian f32 x 8 each: origin, tnear, direction, tfar.
    #[arg(long, value_name = "RAYS")]
    pub rays: PathBuf,

    /// Hits, 24 bytes a ray: f32 t (infinity: no hit), u, v; u32 geometry; u64 triangle. With --occluded one byte
    /// a ray.
    #[arg(short, long, value_name = "HITS")]
    pub output: Option<PathBuf>,

    /// Only tell whether something is on each ray.
    #[arg(long, conflicts_with = "packets")]
    pub occluded: bool,

    /// Trace each 64 rays in a row as a packet: for rays from one point in nearly one direction, such as the camera
    /// rays of blocks of 8 x 8 pixels. The hits are the same.
    #[arg(long)]
    pub packets: bool,

    /// Threads.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,

    /// Trace so many times and report the best.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub repeat: u32,

    /// Instructions to use: portable, or avx2 or avx512 where the processor has them [default: the fastest].
    #[arg(long, value_name = "KERNEL")]
    pub kernel: Option<String>,

    /// Print one JSON object about the run.
    #[arg(long)]
    pub json: bool,
}

/// Flags of `info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// The pack.
    pub pack: PathBuf,

    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Flags of `verify`.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// The pack.
    pub pack: PathBuf,
}

fn parse_positions(text: &str) -> Result<Positions, String> {
    let bits = match text {
        "exact" => return Ok(Positions::Exact),
        "grid" => Ok(16),
        _ => text.strip_prefix("grid:").unwrap_or_default().parse(),
    };
    match bits {
        Ok(bits @ 4..=23) => Ok(Positions::Grid { bits }),
        _ => Err("neither exact, nor grid, nor grid:BITS with 4 to 23 bits".into()),
    }
}

fn parse_page_size(text: &str) -> Result<u32, String> {
    match parse_size(text)? {
        size @ 4096..=524_288 => Ok(size as u32),
        _ => Err("a page has 4K to 512K bytes".into()),
    }
}

fn parse_ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse().ok().filter(|ratio| (0.0..=1.0).contains(ratio));
    ratio.ok_or_else(|| format!("'{text}' is not a share between 0 and 1"))
}

fn parse_width(text: &str) -> Result<f64, String> {
    let width = text.parse().ok().filter(|&width: &f64| width > 0.0 && width.is_finite());
    width.ok_or_else(|| format!("'{text}' is not a width above 0"))
}

fn parse_angle(text: &str) -> Result<f32, String> {
    let angle = text.parse().ok().filter(|angle: &f32| angle.is_finite());
    angle.ok_or_else(|| format!("'{text}' is not an angle in degrees"))
}

fn parse_strength(text: &str) -> Result<f32, String> {
    let factor = text.parse().ok().filter(|factor| (0.0..=1e6).contains(factor));
    factor.ok_or_else(|| format!("'{text}' is not a factor from 0 to a million"))
}

fn parse_picture_size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || format!("'{text}' is not WIDTHxHEIGHT in pixels, each 1 to 65536");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=65536).contains(n)).ok_or_else(wrong);
    Ok((side(width)?, side(height)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn flags_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn sizes() {
        assert_eq!(parse_picture_size("640x480"), Ok((640, 480)));
        assert!(parse_picture_size("0x480").is_err());
        assert_eq!(parse_page_size("64K"), Ok(65536));
        assert!(parse_page_size("1M").is_err());
    }
}
