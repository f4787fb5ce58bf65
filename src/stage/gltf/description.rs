//! The JSON of a glTF file, as far as it is read.

use gltf_json::extensions::root as extensions;
use gltf_json::{
    Accessor, Asset, Buffer, Camera, Image, Index, Material, Mesh, Node, Texture, buffer, texture,
};
use serde::Deserialize;

/// The parts of a file that are read. Everything else, such as animations and skins, is skipped
/// without parsing, so that it cannot cause an error.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
#[allow(missing_docs, reason = "the names of the format")]
pub struct Root {
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    pub asset: Asset,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub buffer_views: Vec<buffer::View>,
    #[serde(default)]
    pub scene: Option<Index<gltf_json::Scene>>,
    #[serde(default)]
    pub extensions: Option<extensions::Root>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    #[serde(default)]
    pub cameras: Vec<Camera>,
    #[serde(default)]
    pub images: Vec<Image>,
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub samplers: Vec<texture::Sampler>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub textures: Vec<Texture>,
}

/// A scene; it may be empty.
#[derive(Debug, Deserialize)]
pub struct Scene {
    /// Nodes without a parent.
    #[serde(default)]
    pub nodes: Vec<Index<Node>>,
}
