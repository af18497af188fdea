use super::*;

#[test]
fn what_is_no_c3d_or_cut_off_is_refused() {
    let refused = |bytes: &[u8]| read(bytes, None).expect_err("refused");
    assert!(refused(b"").starts_with("needed a C3D file"));
    assert_eq!(refused(&[2, 80]), CUT);
    let mut header = vec![0; 2 * BLOCK];
    (header[0], header[1], header[BLOCK + 3]) = (2, MARK, 84);
    assert!(refused(&header).starts_with("the group of parameters POINT is missing"));
    header[BLOCK + 3] = 1;
    assert!(refused(&header).starts_with("needed processor 84 (Intel), 85 (DEC) or 86 (SGI), found `1`"));
}
