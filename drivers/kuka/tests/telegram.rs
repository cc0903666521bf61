//! The telegrams of RSI.
#![allow(clippy::unwrap_used, reason = "tests")]

use driver_kuka::{answer, read};

const TEXT: &str = "<Rob Type=\"KUKA\"><RIst X=\"1.0\"/><ASPos A1=\"7\" A2=\"7\" A3=\"7\" A4=\"7\" \
    A5=\"7\" A6=\"7\"/><AIPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.5\" A5=\"90.0\" \
    A6=\"0.0\"/><Delay D=\"0\"/><IPOC>123456</IPOC></Rob>";

#[test]
fn a_telegram_is_read_and_answered() {
    let telegram = read(TEXT).unwrap();
    assert!((telegram.angles[1] + core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!(telegram.ipoc, 123_456);
    let mut text = String::new();
    answer(&mut text, &[0.0, 0.01, 0.0, 0.0, 0.0, -0.02], telegram.ipoc);
    assert_eq!(
        text,
        "<Sen Type=\"CANTER\"><AKorr A1=\"0.000000000\" A2=\"0.572957795\" A3=\"0.000000000\" \
         A4=\"0.000000000\" A5=\"0.000000000\" A6=\"-1.145915590\"/><IPOC>123456</IPOC></Sen>"
    );
}

#[test]
fn what_is_no_telegram_is_none() {
    for length in 0..TEXT.len() - 1 {
        let cut = &TEXT[..length];
        assert!(
            read(cut).is_none() || cut.contains("<IPOC>123456<"),
            "{cut}"
        );
    }
    assert!(read(&TEXT.replace("0.5", "nan")).is_none());
    assert!(read(&TEXT.replace("A4=\"0.5\"", "")).is_none());
    assert!(read(&TEXT.replace("123456", "-1")).is_none());
}
