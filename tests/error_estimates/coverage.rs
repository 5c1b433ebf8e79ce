//! Closed form of pictures of unshaded balls of one colour.
//!
//! The rays of one scanline that hit a ball form an interval, whose ends are the roots of a
//! quadratic. The value of a pixel is the covered share of many scanlines through it.

/// Number of scanlines in a row of pixels.
const LINES: usize = 4096;

const EYE_Z: f64 = 10.0;
/// Vertical view angle of the camera, in degrees.
const VIEW_ANGLE: f64 = 40.0;

/// Balls of one colour in front of a background. The eye looks along -z; +y is up.
pub struct Balls {
    /// Centre and radius of each ball.
    pub balls: Vec<([f64; 3], f64)>,
    /// Radiance of the balls.
    pub radiance: f64,
    /// Radiance of the background.
    pub background: f64,
}

impl Balls {
    /// Returns the mean radiance of every pixel of a picture of `width` x `height` pixels, row by
    /// row.
    pub fn pixels(&self, [width, height]: [usize; 2]) -> Vec<f64> {
        let [w, h] = [width, height].map(|n| n as f64);
        // Direction of the ray through the point (x, y) of the raster: (u, v, -1).
        let scale = 2.0 * (0.5 * VIEW_ANGLE).to_radians().tan() / h;
        let v_of = |y: f64| scale * (0.5 * h - y);
        let column_of = |u: f64| (u / scale + 0.5 * w).clamp(0.0, w);
        let mut coverage = vec![0.0; width * height];
        let mut spans: Vec<(f64, f64)> = Vec::new();
        for row in 0..height {
            let (top, bottom) = (v_of(row as f64), v_of((row + 1) as f64));
            let near: Vec<_> = self
                .balls
                .iter()
                .filter(|([_, y, z], radius)| {
                    let distance = EYE_Z - z;
                    let (center, reach) = (y / distance, 2.0 * radius / distance);
                    center - reach <= top && center + reach >= bottom
                })
                .collect();
            for line in 0..LINES {
                let v = v_of(row as f64 + (line as f64 + 0.5) / LINES as f64);
                spans.clear();
                spans.extend(near.iter().filter_map(|ball| {
                    let [left, right] = hit_interval(ball.0, ball.1, v)?;
                    Some((column_of(left), column_of(right)))
                }));
                spans.sort_by(|a, b| a.0.total_cmp(&b.0));
                let mut end = 0.0f64;
                for (left, right) in &spans {
                    let mut x = left.max(end);
                    while x < *right {
                        let next = (x.floor() + 1.0).min(*right);
                        coverage[row * width + (x as usize).min(width - 1)] += next - x;
                        x = next;
                    }
                    end = end.max(*right);
                }
            }
        }
        let radiance =
            |sum: &f64| self.background + (self.radiance - self.background) * sum / LINES as f64;
        coverage.iter().map(radiance).collect()
    }
}

/// Returns the interval of u in which the rays from the eye with the directions (u, v, -1) hit a
/// ball. Let c be the vector from the eye to the ball's centre. A ray d hits if (c.d)^2 >= |d|^2
/// (c.c - r^2).
fn hit_interval([x, y, z]: [f64; 3], radius: f64, v: f64) -> Option<[f64; 2]> {
    let z = z - EYE_Z;
    let along = y * v - z;
    let rest = x * x + y * y + z * z - radius * radius;
    let (a, b, c) = (x * x - rest, x * along, along * along - rest * (v * v + 1.0));
    // a u^2 + 2 b u + c >= 0 with a < 0, because the ball is beside the eye's plane.
    let discriminant = b * b - a * c;
    (discriminant > 0.0).then(|| {
        let root = discriminant.sqrt();
        [(-b + root) / a, (-b - root) / a]
    })
}
