//! Addresses of controllers, as a user gives them.

/// The host of `host` or `host:port`: a controller has ports for several purposes.
///
/// ```
/// assert_eq!(driver_kit::host("172.16.0.2"), "172.16.0.2");
/// assert_eq!(driver_kit::host("arm.local:1337"), "arm.local");
/// ```
pub fn host(address: &str) -> &str {
    match address.rsplit_once(':') {
        Some((host, port)) if port.parse::<u16>().is_ok() => host,
        _ => address,
    }
}
