//! Strands of hair: from files to packs, proxies and hits.

use crate::models::Mesh;
use crate::pictures::Exr;
use crate::support::{Folder, assert_keys};
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_tracer::{ProxyKind, Scene};

/// A lawn of curled strands of eight segments in the hair format, on the unit square for each `side`².
pub fn lawn(side: u32) -> Vec<u8> {
    let strands = side * side;
    let mut bytes = b"HAIR".to_vec();
    for number in [strands, 9 * strands, 2, 8] {
        bytes.extend(number.to_le_bytes());
    }
    for number in [0.04f32, 0.4, 0.3, 0.7, 0.2] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.resize(128, 0);
    for strand in 0..strands {
        let (x, y) = ((strand % side) as f32, (strand / side) as f32);
        let turn = (x * 1.7 + y * 2.3).sin();
        for k in 0..9 {
            let s = k as f32 / 8.0;
            for coordinate in [x + 0.3 * turn * s * s, s * (1.0 + 0.2 * turn), y + 0.4 * s * s] {
                bytes.extend(coordinate.to_le_bytes());
            }
        }
    }
    bytes
}

#[test]
fn what_convert_and_info_tell() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(30));
    folder.write("ground.ply", Mesh::hills(40).ply());
    let told = folder.run("convert lawn.hair ground.ply -o a.rsp --json").done().json();
    assert_keys(&told, &["segments", "bytes_per_segment", "bytes_per_triangle", "radius_error"]);
    assert_eq!((&told["segments"], &told["triangles"]), (&7200.into(), &3200.into()));
    assert_eq!(told["vertices"], 30 * 30 * 9 + 41 * 41);
    let each = told["bytes_per_segment"].as_f64().unwrap();
    assert!((6.0..20.0).contains(&each), "{told}");
    let info = folder.run("info a.rsp").done().stdout;
    assert!(info.contains("7,200 segments of strands") && info.contains("bytes/segment"), "{info}");
    folder.run("verify a.rsp").done();
    folder.run("render a.rsp -o a.png --size 40x30 --spp 1").done();
}

#[test]
fn threads_memory_and_kept_ids_change_nothing_else() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(400));
    for (name, options) in [
        ("a.rsp", "--threads 1"),
        ("b.rsp", "--threads 2 --memory 200M"),
        ("c.rsp", "--threads 2 --memory 2G"),
    ] {
        folder.run(&format!("convert lawn.hair -o {name} {options}")).done_with_notes();
    }
    assert!(folder.read("a.rsp") == folder.read("b.rsp") && folder.read("a.rsp") == folder.read("c.rsp"));
    folder.run("convert lawn.hair -o ids.rsp --keep-ids --no-proxy").done();
    let scene = Scene::open(&folder.path("ids.rsp")).unwrap();
    let mut tracer = raystrips_tracer::Tracer::new(&scene);
    let mut found = 0;
    for strand in (0..160_000u32).step_by(997) {
        // From the side to the middle of the first segment.
        let root = glam::Vec3::new((strand % 400) as f32, 0.06, (strand / 400) as f32);
        let ray = raystrips_geom::Ray::new(root - glam::Vec3::X * 0.3, glam::Vec3::X);
        let hit = tracer.intersect(&ray);
        assert!(hit.is_hit(), "{strand}");
        found += u32::from(scene.resolve(&hit).triangle == u64::from(strand) * 8);
    }
    assert!(found > 150, "{found}");
}

#[test]
fn packs_have_proxies_of_their_hair() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(250));
    let told = folder.run("convert lawn.hair -o a.rsp --json").done().json();
    let wanted = 0.02 * 500_000.0;
    let fine = told["proxy"]["triangles"].as_f64().unwrap();
    assert!((fine / wanted - 1.0).abs() < 0.1, "{told}");
    let proxy = Scene::open_proxy(&folder.path("a.rsp"), ProxyKind::Fine).unwrap().unwrap();
    assert_eq!(proxy.manifest().segments as f64, fine);
}

#[test]
fn proxies_are_whole_strands() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(100));
    for name in ["few.hair", "few.obj"] {
        let told = folder.run(&format!("proxy lawn.hair -o {name} --ratio 0.1 --json")).done().json();
        let strands = told["strands"].as_u64().unwrap();
        assert!((900..1100).contains(&strands), "{told}");
        assert_eq!(told["segments"], strands * 8);
        let convert = format!("convert {name} -o few.rsp --strand-width 0.1 --json");
        let read = folder.run(&convert).done_with_notes().json();
        assert_eq!(read["segments"], told["segments"], "{name}");
    }
    let refused = folder.run("proxy lawn.hair -o few.ply");
    assert!(refused.code == Some(1) && refused.stderr.contains(".hair"), "{refused:#?}");
}

#[test]
fn lines_become_strands_when_their_width_is_known() {
    let folder = Folder::new();
    folder.write("lines.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nl 1 2 3\nl -2 -1\nf 1 2 4\n");
    let without = folder.run("convert lines.obj -o a.rsp --json");
    assert!(without.code == Some(0) && without.stderr.contains("--strand-width"), "{without:#?}");
    assert_eq!(without.json()["segments"], 0);
    let with = folder.run("convert lines.obj -o a.rsp --strand-width 0.25 --json").done().json();
    assert_eq!((&with["segments"], &with["triangles"]), (&3.into(), &1.into()));
    let scene = "model = [ { file = \"lines.obj\", strand_width = 0.5, scale = 2.0 } ]\n";
    folder.write("scene.toml", scene);
    let placed = folder.run("convert scene.toml -o b.rsp --json").done().json();
    assert_eq!(placed["segments"], 3);
    // A radius of 0.25 in the file is 0.5 in the scene.
    let min = placed["bounds"]["min"][0].as_f64().unwrap();
    assert!((min + 0.5).abs() < 1e-3, "{placed}");
}

#[test]
fn line_strips_of_gltf_become_strands() {
    let folder = Folder::new();
    let positions: Vec<u8> =
        [0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    folder.write("lines.bin", &positions);
    for (mode, segments) in [(1, 2), (2, 4), (3, 3)] {
        let document = serde_json::json!({
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 1, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 48}],
            "buffers": [{"uri": "lines.bin", "byteLength": 48}],
        });
        folder.write("lines.gltf", document.to_string());
        let told = folder.run("convert lines.gltf -o a.rsp --strand-width 0.1 --json").done().json();
        assert_eq!(told["segments"], segments, "mode {mode}");
    }
}

/// A conversion that was killed when pieces of hair were in the pack goes on from there.
#[test]
fn interrupted_conversions_go_on() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(400));
    folder.write("ground.ply", Mesh::hills(300).ply());
    let command = "convert lawn.hair ground.ply -o out.rsp --memory 200M --threads 2";
    folder.run(command).done_with_notes();
    let whole = folder.read("out.rsp");
    for delay in [50, 150, 250, 350, 450] {
        std::fs::remove_file(folder.path("out.rsp")).unwrap();
        let mut running = folder.start(command);
        std::thread::sleep(std::time::Duration::from_millis(delay));
        running.child.kill().unwrap();
        running.child.wait().unwrap();
        folder.run(command).done_with_notes();
        assert!(folder.read("out.rsp") == whole, "{delay}");
    }
}

/// One piece of hair is what all of it in one conversion by the library is.
#[test]
fn the_library_takes_hair_too() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(20));
    let output = folder.path("a.rsp");
    let report =
        convert(&[folder.path("lawn.hair")], &output, &ConvertParams::default(), &Unobserved).unwrap();
    assert_eq!((report.manifest.segments, report.manifest.triangles()), (3200, 0));
    assert_eq!(report.manifest.vertices, 3600);
}

/// Around strands there are no discs with photons, and some are partly opaque.
#[test]
fn photons_find_the_light_of_hair() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(12));
    folder.write("ground.ply", Mesh::hills(12).ply());
    folder.write("lamp.obj", "v 2 9 2\nv 9 9 2\nv 9 9 9\nv 2 9 9\nf 1 2 3 4\n");
    let scene = "material = [ { name = 'lamp', emission = [4.0, 4.0, 4.0] }, { name = 'fair', base_color = [0.9, 0.8, 0.6] } ]\n\
                 sky = { color = [0.2, 0.3, 0.4] }\n\
                 model = [ { file = 'lawn.hair' }, { file = 'ground.ply', material = 'fair' }, \
                 { file = 'lamp.obj', material = 'lamp' } ]";
    folder.write("scene.toml", scene);
    folder.run("convert scene.toml -o lawn.rsp").done();
    let mean = |options: &str| {
        folder.run(&format!("render lawn.rsp -o a.exr --size 32x24 --spp 256 {options}")).done();
        let exr = Exr::read(&folder.path("a.exr"));
        ["R", "G", "B"].map(|name| exr.channels[name].iter().sum::<f32>() / (32.0 * 24.0))
    };
    let path = mean("");
    let photon = mean("--integrator photon --photons 200000 --photon-passes 2");
    for (a, b) in photon.iter().zip(path) {
        assert!((a / b - 1.0).abs() < 0.015, "path {path:?}, photons {photon:?}");
    }
}
