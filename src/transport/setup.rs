//! Input of a renderer. Rendering, cost and the pool all compare setups by this type.

use std::sync::Arc;

use footlight_show::geometry::View;
use footlight_stage::{Rig, Scene};

/// Input of a renderer: surfaces, lights and view.
///
/// Clones share scene and rig.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Surfaces.
    pub scene: Arc<Scene>,
    /// Lights.
    pub rig: Arc<Rig>,
    /// Camera.
    pub view: View,
}

impl Setup {
    /// A setup from its three parts; a scene or rig in an [`Arc`] is shared.
    pub fn new(scene: impl Into<Arc<Scene>>, rig: impl Into<Arc<Rig>>, view: View) -> Setup {
        Setup {
            scene: scene.into(),
            rig: rig.into(),
            view,
        }
    }

    /// True when scene and view are equal, whatever the lights.
    pub fn has_same_scene(&self, other: &Setup) -> bool {
        self.view == other.view && same(&self.scene, &other.scene)
    }
}

impl PartialEq for Setup {
    fn eq(&self, other: &Setup) -> bool {
        let Setup { scene, rig, view } = other;
        self.view == *view && same(&self.scene, scene) && same(&self.rig, rig)
    }
}

/// Equality that first compares pointers, as a scene may have many thousands of polygons.
fn same<T: PartialEq>(a: &Arc<T>, b: &Arc<T>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::vec3;
    use footlight_show::units::Rgb;
    use footlight_stage::{Material, Source};

    fn setup() -> Setup {
        let view = View {
            from: vec3(0.0, -1.0, 0.0),
            to: vec3(0.0, 0.0, 0.0),
            fov: 40.0,
            roll: 0.0,
            width: 2,
            height: 1,
        };
        Setup::new(Scene::default(), Rig::default(), view)
    }

    #[test]
    fn setups_are_equal_by_content_whether_shared_or_not() {
        let one = setup();
        assert_eq!(one, one.clone());
        assert_eq!(one, setup());
        assert!(one.has_same_scene(&setup()));
    }

    #[test]
    fn another_rig_leaves_the_scene_and_another_scene_or_view_does_not() {
        let one = setup();
        let source = Source {
            name: "front".to_owned(),
            emitters: Vec::new(),
        };
        let rig = Rig {
            sources: vec![source],
            ..Rig::default()
        };
        let relit = Setup::new(Arc::clone(&one.scene), rig, one.view.clone());
        assert!(one != relit && one.has_same_scene(&relit));
        let material = Material::diffuse("red", Rgb([0.5, 0.0, 0.0]));
        let scene = Scene {
            materials: vec![material],
            ..Scene::default()
        };
        let repainted = Setup::new(scene, Arc::clone(&one.rig), one.view.clone());
        assert!(one != repainted && !one.has_same_scene(&repainted));
        let mut wider = one.clone();
        wider.view.width = 3;
        assert!(one != wider && !one.has_same_scene(&wider));
    }
}
