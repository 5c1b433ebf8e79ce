//! Linear RGB colours with the primaries of sRGB.

/// Linear RGB colour without an upper bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Color(pub [f64; 3]);

/// Names of CSS, each before its sRGB code.
const NAMED: &str = "\
    black #000000 white #ffffff gray #808080 grey #808080 silver #c0c0c0 red #ff0000 \
    darkred #8b0000 crimson #dc143c tomato #ff6347 coral #ff7f50 salmon #fa8072 orange #ffa500 \
    gold #ffd700 yellow #ffff00 khaki #f0e68c olive #808000 lime #00ff00 green #008000 \
    darkgreen #006400 teal #008080 turquoise #40e0d0 cyan #00ffff skyblue #87ceeb blue #0000ff \
    navy #000080 indigo #4b0082 violet #ee82ee purple #800080 magenta #ff00ff pink #ffc0cb \
    brown #a52a2a";

impl Color {
    /// Black: zero in every channel.
    pub const BLACK: Self = Self([0.0; 3]);
    /// White: one in every channel.
    pub const WHITE: Self = Self([1.0; 3]);

    /// Returns the colour with each channel multiplied by `s`.
    pub fn scaled(self, s: f64) -> Self {
        Self(self.0.map(|c| c * s))
    }

    /// Returns the largest of the three channels.
    pub fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Parses an sRGB colour `#rrggbb`; `None` if `text` has another form.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.strip_prefix('#')?;
        // All characters are checked here, because `from_str_radix` would also accept a sign.
        if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            return None;
        }
        let rgb = u32::from_str_radix(digits, 16).ok()?;
        Some(Self([16, 8, 0].map(|shift| linear_from_srgb(f64::from(rgb >> shift & 255) / 255.0))))
    }

    /// Parses a colour as users type it: `#rrggbb`, `#rgb`, a CSS name, hue (degrees), saturation and
    /// value such as `hsv 30 1 1`, or the colour of a black body at a temperature, such as `2700 K`.
    pub fn typed(text: &str) -> Option<Self> {
        let text = text.trim().to_lowercase();
        if let Some(digits) = text.strip_prefix('#') {
            let times = if digits.chars().count() == 3 { 2 } else { 1 };
            let digits: String =
                digits.chars().flat_map(|c| [c, c].into_iter().take(times)).collect();
            return Self::from_hex(&format!("#{digits}"));
        }
        let mut words = NAMED.split(' ');
        if let Some(code) = words.by_ref().find(|word| *word == text).and(words.next()) {
            return Self::from_hex(code);
        }
        if let Some(kelvin) = text.strip_suffix('k') {
            let kelvin: f64 = kelvin.trim().parse().ok()?;
            return (1000.0..=40_000.0).contains(&kelvin).then(|| Self::black_body(kelvin));
        }
        let hsv = text.strip_prefix("hsv")?;
        let parts = hsv.split(|c: char| " ,()".contains(c)).filter(|part| !part.is_empty());
        let parts: Option<Vec<f64>> = parts.map(|part| part.parse().ok()).collect();
        let [hue, saturation, value] = parts?.try_into().ok()?;
        if !hue.is_finite() || [saturation, value].iter().any(|x| !(0.0..=1.0).contains(x)) {
            return None;
        }
        Some(Self([5.0f64, 3.0, 1.0].map(|n| {
            let k = (n + hue / 60.0).rem_euclid(6.0);
            linear_from_srgb(value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0))
        })))
    }

    /// Returns the colour of a black body at a temperature between 1000 and 40,000 kelvin, with 1 as
    /// the largest channel. Channels that sRGB cannot represent are 0.
    fn black_body(kelvin: f64) -> Self {
        // Chromaticity of the Planckian locus: Kim et al., US patent 7024034.
        let t = 1e3 / kelvin.clamp(1667.0, 25_000.0);
        let cubic = |[a, b, c, d]: [f64; 4], t: f64| ((a * t + b) * t + c) * t + d;
        let x = match kelvin {
            ..4000.0 => cubic([-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_910], t),
            _ => cubic([-3.025_846_9, 2.107_037_9, 0.222_634_7, 0.240_390], t),
        };
        let y = match kelvin {
            ..2222.0 => cubic([-1.106_381_4, -1.348_110_2, 2.185_558_32, -0.202_196_83], x),
            ..4000.0 => cubic([-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67], x),
            _ => cubic([3.081_758, -5.873_386_7, 3.751_129_97, -0.370_014_83], x),
        };
        let (x, z) = (x / y, (1.0 - x - y) / y);
        let rgb = [
            3.240_454_2 * x - 1.537_138_5 - 0.498_531_4 * z,
            -0.969_266 * x + 1.876_010_8 + 0.041_556 * z,
            0.055_643_4 * x - 0.204_025_9 + 1.057_225_2 * z,
        ];
        let largest = rgb.iter().fold(0.0f64, |m, c| m.max(*c));
        Self(rgb.map(|c| crate::value::rounded_to((c / largest).max(0.0), -3)))
    }

    /// Returns the `#rrggbb` that decodes to exactly this colour, if one exists.
    pub fn to_hex(self) -> Option<String> {
        let [r, g, b] = self.0.map(|channel| (srgb_from_linear(channel) * 255.0).round() as u8);
        let text = format!("#{r:02x}{g:02x}{b:02x}");
        (Self::from_hex(&text) == Some(self)).then_some(text)
    }
}

/// Converts linear light in 0..=1 to an sRGB level in 0..=1 (IEC 61966-2-1).
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Converts an sRGB level (IEC 61966-2-1) from 0..1 to linear light in 0..1.
pub fn linear_from_srgb(level: f64) -> f64 {
    if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::Color;

    #[test]
    fn hex_colors_round_trip() {
        for code in ["#000000", "#ffffff", "#0a80fe", "#010b0c"] {
            let color = Color::from_hex(code).unwrap();
            assert_eq!(color.to_hex().as_deref(), Some(code));
        }
        assert_eq!(Color::from_hex("#ffffff"), Some(Color::WHITE));
        let half = Color::from_hex("#bcbcbc").unwrap().0[0];
        assert!((half - 0.502_886).abs() < 1e-6, "sRGB 188 is {half}");
        assert_eq!(Color([0.5, 0.5, 0.5]).to_hex(), None);
        assert_eq!(Color([2.0, 0.0, 0.0]).to_hex(), None);
        assert_eq!(Color([f64::NAN, 0.0, 0.0]).to_hex(), None);
    }

    #[test]
    fn typed_colours_have_names_hues_and_temperatures() {
        let typed = |text| Color::typed(text).unwrap().0;
        assert_eq!([typed("#f80"), typed("#FFF")], [typed("#ff8800"), [1.0; 3]]);
        assert_eq!([typed("Red"), typed("hsv 0 1 1")], [[1.0, 0.0, 0.0]; 2]);
        assert_eq!(typed("hsv(240, 1, 1)"), typed("blue"));
        let [red, green, blue] = typed("2700 K");
        assert!(red == 1.0 && (0.3..0.5).contains(&green) && (0.05..0.15).contains(&blue));
        // D65 is near 6500 K.
        assert!(typed("6500k").iter().all(|c| *c > 0.9));
        for text in ["redd", "hsv 1 2 3", "hsv 1 1", "100 K", "-1 K", "nan k", "#ff", "#gggg"] {
            assert_eq!(Color::typed(text), None, "{text}");
        }
    }

    #[test]
    fn malformed_hex_colors_are_rejected() {
        for text in ["", "#", "ffffff", "#fff", "#+12345", "#gggggg", "#ffffff0", "#ééé"] {
            assert_eq!(Color::from_hex(text), None, "{text}");
        }
    }
}
