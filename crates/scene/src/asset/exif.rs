//! Orientation of images in EXIF data, which cameras write.
//!
//! EXIF data are a TIFF file: a table of entries with tag, type, number of values and value. Source:
//! Exif 2.32 (CIPA DC-008), section 4.6.4, tag 0x0112.

/// Position of an image's first pixel and of its first row on the screen, 1 to 8 as in EXIF data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation(u8);

impl Orientation {
    /// Orientation of an image whose first row is the upper one and begins on the left.
    pub const UPRIGHT: Self = Self(1);

    /// Returns the orientation in EXIF data. Returns [`Orientation::UPRIGHT`] if the data have none
    /// or are invalid.
    pub fn of_exif(data: &[u8]) -> Self {
        Self(entry(data).filter(|code| (1..=8).contains(code)).unwrap_or(1) as u8)
    }

    /// Turns and mirrors the pixels of an image so that they are upright. `values` are those of the
    /// pixels, row by row, `channels` each. Returns the size and the values of the upright image.
    pub fn apply<T: Copy>(
        self,
        size: [u32; 2],
        channels: usize,
        values: Vec<T>,
    ) -> ([u32; 2], Vec<T>) {
        if self == Self::UPRIGHT {
            return (size, values);
        }
        let [width, height] = size.map(|n| n as usize);
        let mirrored_x = matches!(self.0, 2 | 3 | 7 | 8);
        let mirrored_y = matches!(self.0, 3 | 4 | 6 | 7);
        let transposed = self.0 >= 5;
        let (columns, rows) = if transposed { (height, width) } else { (width, height) };
        let mut out = Vec::with_capacity(values.len());
        for row in 0..rows {
            for column in 0..columns {
                let (x, y) = if transposed { (row, column) } else { (column, row) };
                let x = if mirrored_x { width - 1 - x } else { x };
                let y = if mirrored_y { height - 1 - y } else { y };
                let first = (y * width + x) * channels;
                out.extend_from_slice(&values[first..first + channels]);
            }
        }
        ([columns as u32, rows as u32], out)
    }
}

/// Returns the value of the first orientation entry in EXIF data.
fn entry(data: &[u8]) -> Option<u32> {
    let is_big_endian = match data.get(..4)? {
        b"MM\0*" => true,
        b"II*\0" => false,
        _ => return None,
    };
    let number = |bytes: &[u8]| {
        let shift = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        if is_big_endian { bytes.iter().fold(0, shift) } else { bytes.iter().rev().fold(0, shift) }
    };
    let table = data.get(number(data.get(4..8)?) as usize..)?;
    let count = number(table.get(..2)?) as usize;
    // The orientation is one number (1) of 16 bits (3).
    let is_orientation =
        |entry: &&[u8]| [&entry[..2], &entry[2..4], &entry[4..8]].map(number) == [0x112, 3, 1];
    let found = table[2..].chunks_exact(12).take(count).find(is_orientation)?;
    Some(number(&found[8..10]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns EXIF data with two entries. The second one is the orientation.
    fn exif(is_big_endian: bool, orientation: u16) -> Vec<u8> {
        let short = |n: u16| if is_big_endian { n.to_be_bytes() } else { n.to_le_bytes() };
        let long = |n: u32| if is_big_endian { n.to_be_bytes() } else { n.to_le_bytes() };
        let mut data = if is_big_endian { b"MM\0*".to_vec() } else { b"II*\0".to_vec() };
        data.extend([long(8), long(0)].concat());
        data.splice(8.., short(2));
        for (tag, value) in [(0x100, 7), (0x112, orientation)] {
            data.extend([short(tag), short(3)].concat());
            data.extend(long(1));
            data.extend([short(value), short(0)].concat());
        }
        data
    }

    #[test]
    fn orientation_is_read_in_both_byte_orders() {
        for is_big_endian in [false, true] {
            for code in 1..=8 {
                let data = exif(is_big_endian, code.into());
                assert_eq!(Orientation::of_exif(&data), Orientation(code));
                let cut = (0..data.len()).map(|length| Orientation::of_exif(&data[..length]));
                assert!(cut.into_iter().all(|found| found == Orientation::UPRIGHT));
            }
            for code in [0, 9, 6 << 8] {
                let data = exif(is_big_endian, code);
                assert_eq!(Orientation::of_exif(&data), Orientation::UPRIGHT);
            }
        }
        let mut far = exif(false, 6);
        far[4..8].fill(255);
        assert_eq!(Orientation::of_exif(&far), Orientation::UPRIGHT);
    }

    #[test]
    fn images_become_upright() {
        // The columns of the image are 1 2 3, its rows 10 20.
        let values = vec![11, 12, 13, 21, 22, 23];
        for (code, size, expected) in [
            (1, [3, 2], [11, 12, 13, 21, 22, 23]),
            (2, [3, 2], [13, 12, 11, 23, 22, 21]),
            (3, [3, 2], [23, 22, 21, 13, 12, 11]),
            (4, [3, 2], [21, 22, 23, 11, 12, 13]),
            (5, [2, 3], [11, 21, 12, 22, 13, 23]),
            (6, [2, 3], [21, 11, 22, 12, 23, 13]),
            (7, [2, 3], [23, 13, 22, 12, 21, 11]),
            (8, [2, 3], [13, 23, 12, 22, 11, 21]),
        ] {
            let upright = Orientation(code).apply([3, 2], 1, values.clone());
            assert_eq!(upright, (size, expected.to_vec()), "{code}");
            let double: Vec<_> = values.iter().flat_map(|n| [*n, -n]).collect();
            let expected: Vec<_> = expected.iter().flat_map(|n| [*n, -n]).collect();
            assert_eq!(Orientation(code).apply([3, 2], 2, double), (size, expected), "{code}");
        }
    }
}
