//! Who may connect.

use std::net::IpAddr;
use std::str::FromStr;

use thiserror::Error;

/// A network of addresses, such as `192.168.1.0/24` or a single address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Network {
    address: IpAddr,
    bits: u32,
}

/// Text that is no network.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("expected a network such as 192.168.1.0/24, found {0:?}")]
pub struct AllowError(String);

impl FromStr for Network {
    type Err = AllowError;

    fn from_str(text: &str) -> Result<Self, AllowError> {
        let wrong = || AllowError(text.to_owned());
        let (address, bits) = match text.split_once('/') {
            Some((address, bits)) => (address, Some(bits)),
            None => (text, None),
        };
        let address: IpAddr = address.parse().map_err(|_| wrong())?;
        let most = if address.is_ipv4() { 32 } else { 128 };
        let bits = bits.map_or(Ok(most), |bits| bits.parse().map_err(|_| wrong()))?;
        if bits > most {
            return Err(wrong());
        }
        Ok(Self { address, bits })
    }
}

impl Network {
    /// Whether an address is of this network. An IPv4 address inside an IPv6 one counts as IPv4.
    ///
    /// ```
    /// let cell: crcl_tcp::Network = "10.0.3.0/24".parse()?;
    /// assert!(cell.holds("10.0.3.77".parse().unwrap()));
    /// assert!(!cell.holds("10.0.4.77".parse().unwrap()));
    /// # Ok::<(), crcl_tcp::AllowError>(())
    /// ```
    pub fn holds(&self, address: IpAddr) -> bool {
        let number = |address: IpAddr| match address.to_canonical() {
            IpAddr::V4(address) => (32_u32, u128::from(u32::from(address))),
            IpAddr::V6(address) => (128_u32, u128::from(address)),
        };
        let ((most, ours), (other, theirs)) = (number(self.address), number(address));
        let rest = most.saturating_sub(self.bits);
        most == other && ours.checked_shr(rest) == theirs.checked_shr(rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn networks_hold_their_addresses() {
        let holds = |network: &str, address: &str| {
            let network: Network = network.parse().unwrap();
            network.holds(address.parse().unwrap())
        };
        assert!(holds("0.0.0.0/0", "8.8.8.8") && !holds("0.0.0.0/0", "::1"));
        assert!(holds("192.168.1.5", "192.168.1.5") && !holds("192.168.1.5", "192.168.1.4"));
        assert!(holds("192.168.1.0/25", "192.168.1.127"));
        assert!(!holds("192.168.1.0/25", "192.168.1.128"));
        assert!(holds("fd00::/8", "fd12::1") && !holds("fd00::/8", "fe80::1"));
        assert!(holds("10.0.0.0/8", "::ffff:10.1.2.3"));
        for wrong in ["", "x", "10.0.0.0/33", "10.0.0/8", "10.0.0.0/-1", "::/129"] {
            assert!(wrong.parse::<Network>().is_err(), "{wrong}");
        }
    }
}
