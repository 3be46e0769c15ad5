//! Extensions of materials for what lies over a surface.

use super::{document, glb, read, square_bytes};
use crate::testing::import_bytes;
use raystrips_geom::Streams;
use raystrips_geom::scene::{Anisotropy, Clearcoat, Iridescence, Material, SceneDesc, Sheen};
use serde_json::{Value, json};

/// A picture of one texel.
const TEXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==";

/// What the square's material is with these extensions, and what was told.
fn material(extensions: Value) -> (Material, Vec<String>, SceneDesc) {
    let (done, _) = read(|document, _| {
        document["meshes"][0]["primitives"][0]["material"] = json!(0);
        document["materials"] = json!([{"extensions": extensions}]);
        document["images"] = json!([{"uri": TEXEL}]);
        document["textures"] = json!([{"source": 0}, {"source": 7}]);
    })
    .unwrap();
    (done.scene.materials[0].clone(), done.report.warnings, done.scene)
}

#[test]
fn numbers_of_layers_are_read() {
    let (found, warnings, _) = material(json!({
        "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [2.0, 1.0, 0.5]},
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.25},
        "KHR_materials_sheen": {"sheenColorFactor": [0.25, 0.5, 1.0], "sheenRoughnessFactor": 0.5},
        "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 1.5},
        "KHR_materials_iridescence": {"iridescenceFactor": 1.0, "iridescenceThicknessMaximum": 500.0},
    }));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((found.specular, found.specular_color), (0.5, [2.0, 1.0, 0.5]));
    assert_eq!(found.clearcoat, Clearcoat { strength: 0.75, roughness: 0.25, normal_scale: 1.0 });
    assert_eq!(found.sheen, Sheen { color: [0.25, 0.5, 1.0], roughness: 0.5 });
    assert_eq!(found.anisotropy, Anisotropy { strength: 0.5, rotation: 1.5 });
    let film = Iridescence { strength: 1.0, ior: 1.3, least_thickness: 100.0, thickness: 500.0 };
    assert_eq!(found.iridescence, film);
    let (plain, _, _) = material(json!({}));
    assert_eq!((plain.clearcoat, plain.sheen, plain.specular), (Clearcoat::default(), Sheen::default(), 1.0));
}

#[test]
fn textures_of_layers_are_read_and_used() {
    let texture = json!({"index": 0});
    let (found, warnings, scene) = material(json!({
        "KHR_materials_specular": {"specularTexture": texture, "specularColorTexture": texture},
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 1.0, "clearcoatTexture": texture, "clearcoatRoughnessTexture": texture,
            "clearcoatNormalTexture": texture
        },
        "KHR_materials_sheen": {"sheenColorTexture": texture, "sheenRoughnessTexture": texture},
        "KHR_materials_anisotropy": {"anisotropyTexture": texture},
        "KHR_materials_iridescence": {"iridescenceTexture": texture, "iridescenceThicknessTexture": texture},
    }));
    assert_eq!(found.textures.all().count(), 10);
    let is_srgb = |texture: Option<u32>| {
        let texture = &scene.textures[texture.unwrap() as usize];
        scene.images[texture.image as usize].is_srgb
    };
    let textures = found.textures;
    assert!(is_srgb(textures.specular_color) && is_srgb(textures.sheen_color));
    assert!(!is_srgb(textures.specular) && !is_srgb(textures.clearcoat) && !is_srgb(textures.anisotropy));
    assert!(!is_srgb(textures.clearcoat_normal) && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn layers_without_their_texture_are_nowhere() {
    let missing = json!({"index": 1});
    let (found, warnings, _) = material(json!({
        "KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatTexture": missing},
        "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1], "sheenColorTexture": {"index": 99}},
        "KHR_materials_anisotropy": {"anisotropyStrength": 1.0, "anisotropyTexture": missing},
        "KHR_materials_iridescence": {"iridescenceFactor": 1.0, "iridescenceTexture": missing},
    }));
    assert!((found.clearcoat.strength, found.sheen.color) == (0.0, [0.0; 3]));
    assert!((found.anisotropy.strength, found.iridescence.strength) == (0.0, 0.0));
    assert!(warnings.iter().any(|warning| warning.contains("textures[99]")), "{warnings:?}");
}

#[test]
fn numbers_out_of_range_are_brought_into_it() {
    let (found, _, _) = material(json!({
        "KHR_materials_specular": {"specularFactor": 1e30, "specularColorFactor": [-1.0, 1e39, 2.0]},
        "KHR_materials_clearcoat": {"clearcoatFactor": -5.0, "clearcoatRoughnessFactor": 1e39},
        "KHR_materials_sheen": {"sheenColorFactor": [-1.0, 2.0, 1e39], "sheenRoughnessFactor": -1e39},
        "KHR_materials_anisotropy": {"anisotropyStrength": 1e39, "anisotropyRotation": 1e39},
        "KHR_materials_iridescence": {
            "iridescenceFactor": 3, "iridescenceIor": 0.0, "iridescenceThicknessMinimum": -4.0,
            "iridescenceThicknessMaximum": 1e39
        },
    }));
    assert_eq!((found.specular, found.specular_color), (1.0, [0.0, 0.0, 2.0]));
    assert_eq!(found.clearcoat, Clearcoat { strength: 0.0, roughness: 1.0, normal_scale: 1.0 });
    assert_eq!(found.sheen, Sheen { color: [0.0, 1.0, 1.0], roughness: 0.0 });
    assert_eq!(found.anisotropy, Anisotropy { strength: 1.0, rotation: 0.0 });
    let film = Iridescence { strength: 1.0, ior: 1.3, least_thickness: 0.0, thickness: 400.0 };
    assert_eq!(found.iridescence, film);
}

#[test]
fn extensions_that_do_not_fit_are_left_out() {
    for extension in [json!(3), json!({"clearcoatFactor": "x"}), json!({"clearcoatTexture": {"index": -1}})] {
        let (found, warnings, _) = material(json!({ "KHR_materials_clearcoat": extension }));
        assert_eq!(found.clearcoat, Clearcoat::default());
        assert!(warnings[0].contains("KHR_materials_clearcoat is left out"), "{warnings:?}");
    }
}

#[test]
fn brushed_materials_keep_texture_coordinates() {
    let (mut document, mut binary) = (document(), square_bytes());
    binary.extend([0.0f32; 8].iter().flat_map(|x| x.to_le_bytes()));
    document["buffers"][0]["byteLength"] = json!(binary.len());
    document["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({"buffer": 0, "byteOffset": 60, "byteLength": 32}));
    let coordinates = json!({"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"});
    document["accessors"].as_array_mut().unwrap().push(coordinates);
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["attributes"]["TEXCOORD_0"] = json!(2);
    for (strength, keeps) in [(0.0, false), (0.5, true)] {
        let anisotropy = json!({"KHR_materials_anisotropy": {"anisotropyStrength": strength}});
        document["materials"] = json!([{ "extensions": anisotropy }]);
        let (_, sink) = import_bytes("model.glb", &glb(&document, &binary)).unwrap();
        assert_eq!(sink.0[0].streams.has(Streams::TEX_COORDS_0), keeps, "{strength}");
    }
}

#[test]
fn specular_and_glossiness_are_read_whole() {
    let (found, warnings, scene) = material(json!({"KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.25, 0.125, 1.0], "specularFactor": [0.04, 0.5, 1.0], "glossinessFactor": 0.75,
        "specularGlossinessTexture": {"index": 0}
    }}));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((found.base_color, found.metallic, found.roughness), ([0.5, 0.25, 0.125], 0.0, 0.25));
    assert!(found.specular_color.iter().zip([1.0, 12.5, 25.0]).all(|(a, b)| (a - b).abs() < 1e-5));
    assert!(found.textures.glossiness.is_some());
    assert_eq!(found.textures.glossiness, found.textures.specular_color);
    assert!(scene.images[0].is_srgb);
    // Without its texture a factor of 1 would make a mirror of everything.
    let missing = json!({"specularGlossinessTexture": {"index": 99}});
    let (found, _, _) = material(json!({ "KHR_materials_pbrSpecularGlossiness": missing }));
    assert_eq!((found.specular_color, found.roughness), ([1.0; 3], 1.0));
}

#[test]
fn unlit_is_read_and_what_is_not_is_named() {
    let (found, warnings, _) = material(json!({ "KHR_materials_unlit": {}, "ABC_glitter": {} }));
    assert!(found.unlit && warnings.len() == 1 && warnings[0].contains("ABC_glitter"), "{warnings:?}");
    let used = |name: &str, list: &str| read(|document, _| document[list] = json!([name]));
    for (name, is_told) in [("ABC_other", true), ("KHR_materials_variants", false), ("KHR_xmp", false)] {
        let warnings = used(name, "extensionsUsed").unwrap().0.report.warnings;
        assert_eq!(warnings.iter().any(|warning| warning.contains(name)), is_told, "{warnings:?}");
    }
    for (name, is_refused) in [("KHR_materials_dispersion", true), ("KHR_materials_unlit", false)] {
        assert_eq!(used(name, "extensionsRequired").is_err(), is_refused, "{name}");
    }
}
