//! Coordinate frames: three axes and an origin.

/// Axes and origin of an object in its parent's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    axes: [[f64; 3]; 3],
    pub origin: [f64; 3],
}

impl Default for Frame {
    fn default() -> Frame {
        Frame {
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            origin: [0.0; 3],
        }
    }
}

impl Frame {
    /// Parses MVR's `{u}{v}{w}{o}`: three axes and the origin in millimetres.
    pub fn of_axes(text: &str) -> Option<Frame> {
        let [u, v, w, o] = rows::<3>(text)?;
        let origin = o.map(|millimetres| millimetres / 1000.0);
        Some(Frame {
            axes: [u, v, w],
            origin,
        })
    }

    /// Parses GDTF's four matrix rows, whose last column is the origin in metres.
    pub fn of_rows(text: &str) -> Option<Frame> {
        let [a, b, c, _] = rows::<4>(text)?;
        let ([ax, ay, az, ox], [bx, by, bz, oy], [cx, cy, cz, oz]) = (a, b, c);
        Some(Frame {
            axes: [[ax, bx, cx], [ay, by, cy], [az, bz, cz]],
            origin: [ox, oy, oz],
        })
    }

    /// The frame `inner`, given in this frame, in the parent's coordinates.
    #[must_use]
    pub fn then(&self, inner: Frame) -> Frame {
        Frame {
            axes: inner.axes.map(|axis| self.direction(axis)),
            origin: self.point(inner.origin),
        }
    }

    /// A direction of this frame in the parent's coordinates.
    pub fn direction(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [u, v, w] = self.axes;
        let along = |u: f64, v: f64, w: f64| x * u + y * v + z * w;
        let ([ux, uy, uz], [vx, vy, vz], [wx, wy, wz]) = (u, v, w);
        [along(ux, vx, wx), along(uy, vy, wy), along(uz, vz, wz)]
    }

    /// A point of this frame in the parent's coordinates.
    pub fn point(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.direction(point);
        let [ox, oy, oz] = self.origin;
        [x + ox, y + oy, z + oz]
    }

    /// The mount of a head in this frame: true when it stands on the floor, and the turn of its
    /// base about the vertical in degrees; `None` when the base is not level.
    pub fn mounted(&self) -> Option<(bool, f64)> {
        if let Some((_, turn)) = self.upright() {
            return Some((false, turn));
        }
        let turned_over = Frame {
            axes: self.axes.map(|[x, y, z]| [-x, y, -z]),
            ..*self
        };
        turned_over.upright().map(|(_, turn)| (true, turn))
    }

    /// Scale and turn about the vertical in degrees; `None` if it also tilts.
    pub fn upright(&self) -> Option<(f64, f64)> {
        let [[ux, uy, uz], [vx, vy, vz], [wx, wy, wz]] = self.axes;
        let near = |a: f64, b: f64| (a - b).abs() < 1e-4;
        let scale = ux.hypot(uy);
        let is = near(uz, 0.0) && near(vz, 0.0) && near(wx, 0.0) && near(wy, 0.0);
        let is = is && near(wz, scale) && near(vx, -uy) && near(vy, ux) && scale > 1e-6;
        is.then(|| (scale, uy.atan2(ux).to_degrees()))
    }
}

/// Parses four rows `{a,b,c}` of `N` numbers.
fn rows<const N: usize>(text: &str) -> Option<[[f64; N]; 4]> {
    let mut out = [[0.0; N]; 4];
    let mut rows = text.split('}');
    for row in &mut out {
        let words = rows.next()?.trim().strip_prefix('{')?.split(',');
        let mut words = words.map(|word| word.trim().parse::<f64>().ok());
        for number in row.iter_mut() {
            *number = words.next()??;
            if !number.is_finite() || number.abs() > 1e9 {
                return None;
            }
        }
    }
    Some(out)
}
