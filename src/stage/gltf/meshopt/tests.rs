#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;

/// The specification's example: one group of 16 deltas in four bits, two of which follow in full.
#[test]
fn the_deltas_of_the_specification() {
    let bytes = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
    let mut data = bytes.as_slice();
    let found = deltas(&mut data, 2)
        .unwrap()
        .map(|d| (d >> 1 ^ (d & 1).wrapping_neg()).cast_signed());
    let said = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    assert_eq!(found, said);
    assert!(data.is_empty());
}

#[test]
fn attributes_go_on_from_the_last_element() {
    // Two elements of four bytes: the first is the baseline, the second adds one to its first byte.
    let mut bytes = vec![0xa0, 3];
    bytes.extend([0, 2].iter().chain(&[0; 14]));
    bytes.extend([0, 0, 0]);
    bytes.extend([0; 28]);
    bytes.extend([7, 8, 9, 10]);
    assert_eq!(
        attributes(&bytes, 2, 4).unwrap(),
        [7, 8, 9, 10, 8, 8, 9, 10]
    );
    for length in 0..bytes.len() {
        assert!(attributes(&bytes[..length], 2, 4).is_none());
    }
    assert!(attributes(&bytes, usize::MAX / 8, 4).is_none());
}

#[test]
fn triangles_share_edges_and_vertices() {
    // A new triangle by the table's entry 0 (all new), then its last edge with a new vertex, then
    // the edge before that with an explicit one, 5 further than the last.
    let mut bytes = vec![0xe1, 0xf0, 0x00, 0x1f, 10];
    bytes.extend([0; 16]);
    assert_eq!(triangles(&bytes, 3).unwrap(), [0, 1, 2, 0, 2, 3, 3, 2, 5]);
    assert!(triangles(&bytes, 9).is_none());
}

#[test]
fn indices_follow_one_of_two() {
    // +1 on the first, +100 on the second (two bytes), -1 on the first.
    let bytes = [0xd1, 4, 0x91, 0x03, 2, 0, 0, 0, 0];
    assert_eq!(indices(&bytes, 3).unwrap(), [1, 100, 0]);
    assert!(indices(&bytes, 9).is_none());
}

#[test]
fn filters_give_unit_vectors_and_numbers() {
    let how = |filter, byte_stride| Compressed {
        buffer: 0,
        byte_offset: 0,
        byte_length: 0,
        byte_stride,
        count: 1,
        mode: Mode::Attributes,
        filter,
    };
    let mut down = [0_u8, 0, 127, 5];
    filter(&mut down, &how(Filter::Octahedral, 4)).unwrap();
    assert_eq!(down, [0, 0, 127, 5]);
    let mut aside = [127_u8, 0, 127, 0];
    filter(&mut aside, &how(Filter::Octahedral, 4)).unwrap();
    assert_eq!(aside, [127, 0, 0, 0]);
    // 3 times a half.
    let mut number = (0xff00_0003_u32).to_le_bytes();
    filter(&mut number, &how(Filter::Exponential, 4)).unwrap();
    assert_eq!(f32::from_le_bytes(number), 1.5);
    // The identity rotation, whose w is omitted.
    assert_eq!(quaternion([0, 0, 0, 0x7fff]), [0, 0, 0, 32767]);
    assert!(filter(&mut [0; 12], &how(Filter::Quaternion, 12)).is_none());
}
