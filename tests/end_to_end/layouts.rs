//! `convert --layout`: another file, the same picture.

use crate::models::Mesh;
use crate::support::Folder;
use std::collections::HashSet;

const LAYOUTS: [&str; 7] =
    ["depth-first", "breadth-first", "van-emde-boas", "cache-oblivious", "morton", "hilbert", "random"];

#[test]
fn layouts_change_the_file_and_nothing_else() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(260).ply());
    let rendered = |layout: &str| {
        // With ids, which are found by the numbers of triangles.
        let options = format!("--layout {layout} --keep-ids --no-proxy");
        folder.run(&format!("convert hills.ply -o {layout}.rsp {options}")).done();
        folder.run(&format!("verify {layout}.rsp")).done();
        folder.run(&format!("render {layout}.rsp -o {layout}.exr --size 64x48 --spp 2")).done();
        (folder.read(&format!("{layout}.rsp")), folder.read(&format!("{layout}.exr")))
    };
    let (packs, pictures): (HashSet<Vec<u8>>, HashSet<Vec<u8>>) = LAYOUTS.into_iter().map(rendered).unzip();
    assert_eq!((packs.len(), pictures.len()), (LAYOUTS.len(), 1));
}
