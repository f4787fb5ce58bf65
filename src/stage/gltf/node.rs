//! The nodes of a file and their transforms.

use gltf_json::Node;

use super::container::Document;
use super::description::Root;
use super::{Fault, LeftOut, TRIANGLE_LIMIT, accessor, entry, place};
use crate::stage_file::{FAR_AWAY, limit};
use footlight_show::geometry::{Vec3, vec3};

/// An affine map: scale, rotation and translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Images of the three axes.
    axes: [Vec3; 3],
    /// Image of the origin.
    origin: Vec3,
}

impl Affine {
    const IDENTITY: Affine = Affine {
        axes: [
            vec3(1.0, 0.0, 0.0),
            vec3(0.0, 1.0, 0.0),
            vec3(0.0, 0.0, 1.0),
        ],
        origin: Vec3::ZERO,
    };

    /// Maps a direction; not normalised.
    pub fn direction(&self, d: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        x * d.x + y * d.y + z * d.z
    }

    /// Maps a point.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.direction(p) + self.origin
    }

    /// Maps a normal; not normalised.
    pub fn normal(&self, n: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        let moved = y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z;
        if self.mirrors() { -moved } else { moved }
    }

    /// True when it mirrors, so that fronts become backs.
    pub fn mirrors(&self) -> bool {
        let [x, y, z] = self.axes;
        x.cross(y).dot(z) < 0.0
    }

    /// The composition that applies `inner` first.
    pub fn after(&self, inner: &Affine) -> Affine {
        Affine {
            axes: inner.axes.map(|a| self.direction(a)),
            origin: self.point(inner.origin),
        }
    }

    /// A node's own transform.
    fn of(node: &Node) -> Result<Affine, String> {
        if let Some(m) = &node.matrix {
            return Affine::of_matrix(m.map(f64::from));
        }
        let numbers = |v: Option<[f32; 3]>, default: f32| v.unwrap_or([default; 3]).map(f64::from);
        Affine::of_parts(
            numbers(node.translation, 0.0),
            node.rotation.unwrap_or_default().0.map(f64::from),
            numbers(node.scale, 1.0),
        )
    }

    /// Scale, then rotation by a quaternion, then translation.
    fn of_parts(
        [tx, ty, tz]: [f64; 3],
        [x, y, z, w]: [f64; 4],
        [sx, sy, sz]: [f64; 3],
    ) -> Result<Affine, String> {
        let length = (x * x + y * y + z * z + w * w).sqrt();
        let [x, y, z, w] = [x, y, z, w].map(|c| c / length);
        if !(x + y + z + w).is_finite() {
            return Err("its rotation has no length".to_owned());
        }
        // Columns of the rotation that a unit quaternion stands for.
        let columns = [
            vec3(
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y + z * w),
                2.0 * (x * z - y * w),
            ),
            vec3(
                2.0 * (x * y - z * w),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z + x * w),
            ),
            vec3(
                2.0 * (x * z + y * w),
                2.0 * (y * z - x * w),
                1.0 - 2.0 * (x * x + y * y),
            ),
        ];
        let [a, b, c] = columns;
        Ok(Affine {
            axes: [a * sx, b * sy, c * sz],
            origin: vec3(tx, ty, tz),
        })
    }

    /// From a column-major matrix, as in glTF.
    fn of_matrix(m: [f64; 16]) -> Result<Affine, String> {
        let [
            [a, b, c, last @ ..],
            [d, e, f, last2 @ ..],
            [g, h, i, last3 @ ..],
            [x, y, z, one @ ..],
        ] = chunks_of_four(m);
        let bottom = [last, last2, last3, one].map(|[v]| v);
        let off = bottom.iter().zip([0.0, 0.0, 0.0, 1.0]);
        if off
            .map(|(v, w)| (v - w).abs())
            .any(|d| d.is_nan() || d > 1e-6)
        {
            return Err("its matrix is not affine".to_owned());
        }
        Ok(Affine {
            axes: [vec3(a, b, c), vec3(d, e, f), vec3(g, h, i)],
            origin: vec3(x, y, z),
        })
    }

    fn is_finite(&self) -> bool {
        self.axes.iter().all(|a| a.is_finite()) && self.origin.is_finite()
    }
}

fn chunks_of_four(m: [f64; 16]) -> [[f64; 4]; 4] {
    let [a, b, c, d, e, f, g, h, i, j, k, l, n, o, p, q] = m;
    [[a, b, c, d], [e, f, g, h], [i, j, k, l], [n, o, p, q]]
}

/// A node and its transform.
#[derive(Debug)]
pub struct Placed<'r> {
    /// Index in the file.
    pub index: usize,
    /// The node.
    pub node: &'r Node,
    /// From local to the file's coordinates.
    pub transform: Affine,
}

impl Placed<'_> {
    /// The node's name in messages.
    pub fn place(&self) -> String {
        place("node", self.index, self.node.name.as_ref())
    }
}

/// The nodes of the file's scene (the default one, else the first, else all roots), parents before
/// children, in the order of the file.
///
/// A node may have only one parent, so each is visited once. A cycle, or a branch shared by two
/// parents (with which a file of twenty nodes could ask for a million), is a fault.
pub fn walk<'r>(root: &'r Root, left_out: &mut LeftOut) -> Result<Vec<Placed<'r>>, Fault> {
    let mut seen = vec![false; root.nodes.len()];
    let mut out = Vec::new();
    let mut open: Vec<(usize, Affine, String)> = Vec::new();
    let starts = roots(root)?;
    open.extend(
        starts
            .into_iter()
            .rev()
            .map(|i| (i, Affine::IDENTITY, "the scene".to_owned())),
    );
    while let Some((index, outer, parent)) = open.pop() {
        let node = entry(&root.nodes, index, "node", || parent)?;
        let at = || place("node", index, node.name.as_ref());
        match seen.get_mut(index) {
            Some(seen) if !*seen => *seen = true,
            _ => {
                return Err(Fault::new(
                    at(),
                    "it has two parents, or is its own ancestor",
                ));
            }
        }
        if is_hidden(node) {
            left_out.insert(format!("{}: it is hidden, with what it holds", at()));
            continue;
        }
        let own = Affine::of(node).map_err(|e| Fault::new(at(), e))?;
        let transform = outer.after(&own);
        if !transform.is_finite() {
            return Err(Fault::new(at(), FAR_AWAY));
        }
        let children = node.children.iter().flatten().rev();
        open.extend(children.map(|c| (c.value(), transform, at())));
        out.push(Placed {
            index,
            node,
            transform,
        });
    }
    Ok(out)
}

/// True when a node and everything below it are hidden (KHR_node_visibility).
fn is_hidden(node: &Node) -> bool {
    let extensions = node.extensions.as_ref();
    let described = extensions.and_then(|e| e.others.get("KHR_node_visibility"));
    described.and_then(|d| d.get("visible")) == Some(&serde_json::Value::Bool(false))
}

fn roots(root: &Root) -> Result<Vec<usize>, Fault> {
    let chosen = root.scene.map(|s| s.value());
    if chosen.is_none() && root.scenes.is_empty() {
        let mut held = vec![false; root.nodes.len()];
        for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
            if let Some(held) = held.get_mut(child.value()) {
                *held = true;
            }
        }
        let free = held.iter().enumerate().filter(|(_, held)| !**held);
        return Ok(free.map(|(i, _)| i).collect());
    }
    let at = || "JSON".to_owned();
    let scene = entry(&root.scenes, chosen.unwrap_or(0), "scene", at)?;
    Ok(scene.nodes.iter().map(|n| n.value()).collect())
}

/// Transforms of a node's instances (EXT_mesh_gpu_instancing); one for a node without the
/// extension.
pub fn instances(document: &Document<'_>, placed: &Placed<'_>) -> Result<Vec<Affine>, Fault> {
    let extensions = placed.node.extensions.as_ref();
    let described = extensions.and_then(|e| e.others.get("EXT_mesh_gpu_instancing"));
    let Some(described) = described else {
        return Ok(vec![placed.transform]);
    };
    let index = |name: &str| {
        let index = described.get("attributes")?.get(name)?.as_u64()?;
        usize::try_from(index).ok()
    };
    let moved = index("TRANSLATION").map(|i| accessor::vectors::<3>(document, i));
    let turned = index("ROTATION").map(|i| accessor::vectors::<4>(document, i));
    let scaled = index("SCALE").map(|i| accessor::vectors::<3>(document, i));
    let (moved, turned, scaled) = (moved.transpose()?, turned.transpose()?, scaled.transpose()?);
    let counts = [
        moved.as_ref().map(Vec::len),
        turned.as_ref().map(Vec::len),
        scaled.as_ref().map(Vec::len),
    ];
    let count = counts.into_iter().flatten().min().unwrap_or(0);
    if count > TRIANGLE_LIMIT {
        let limit = limit("instances", TRIANGLE_LIMIT);
        return Err(Fault::new(placed.place(), limit));
    }
    let instance = |i: usize| {
        let of = |list: &Option<Vec<[f64; 3]>>, default: f64| {
            let own = list.as_ref().and_then(|all| all.get(i).copied());
            own.unwrap_or([default; 3])
        };
        let turn = turned.as_ref().and_then(|all| all.get(i).copied());
        let own = Affine::of_parts(
            of(&moved, 0.0),
            turn.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            of(&scaled, 1.0),
        );
        let own = own.map_err(|e| Fault::new(placed.place(), e))?;
        Ok(placed.transform.after(&own))
    };
    (0..count).map(instance).collect()
}
