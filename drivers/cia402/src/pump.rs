//! Moves frames between the library's store and the network while a request is under way.

use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use ethercrab::error::Error;
use ethercrab::{PduRx, PduTx};

use crate::EtherSocket;
use crate::bus_error::BusError;

/// The longest Ethernet frame (bytes).
const FRAME: usize = 1518;

/// How long it waits at once (s): a request may also wait for a time.
const SLICE: Duration = Duration::from_micros(500);

/// The two ends of the library's store, and the network.
pub(crate) struct Pump<'a> {
    pub(crate) interface: &'a str,
    socket: EtherSocket,
    tx: PduTx<'a>,
    rx: PduRx<'a>,
    frame: [u8; FRAME],
}

impl<'a> Pump<'a> {
    pub(crate) fn open(
        interface: &'a str,
        (tx, rx): (PduTx<'a>, PduRx<'a>),
    ) -> Result<Self, BusError> {
        let socket = EtherSocket::open(interface).map_err(|cause| BusError::Interface {
            interface: interface.to_owned(),
            cause,
        })?;
        Ok(Self {
            interface,
            socket,
            tx,
            rx,
            frame: [0; FRAME],
        })
    }

    /// Runs a request until it is done.
    ///
    /// # Errors
    /// [`BusError::Silent`] when no frame comes for `patience`, and what the network says.
    pub(crate) fn run<F: Future>(
        &mut self,
        request: F,
        patience: Duration,
    ) -> Result<F::Output, BusError> {
        let mut request = pin!(request);
        let mut context = Context::from_waker(Waker::noop());
        let mut heard = Instant::now();
        loop {
            if let Poll::Ready(done) = request.as_mut().poll(&mut context) {
                return Ok(done);
            }
            self.send()?;
            let left = patience.saturating_sub(heard.elapsed());
            if self.receive(left.min(SLICE))? {
                heard = Instant::now();
            } else if left.is_zero() {
                let interface = self.interface.to_owned();
                return Err(BusError::Silent { interface });
            }
        }
    }

    fn send(&mut self) -> Result<(), BusError> {
        while let Some(frame) = self.tx.next_sendable_frame() {
            let mut failed = None;
            let sent = frame.send_blocking(|bytes| {
                self.socket.send(bytes).map_err(|cause| {
                    failed = Some(cause);
                    Error::SendFrame
                })
            });
            if let Some(cause) = failed {
                return Err(BusError::Network(cause));
            }
            if sent.is_err() {
                return Err(BusError::Network(std::io::ErrorKind::WriteZero.into()));
            }
        }
        Ok(())
    }

    /// Whether a frame came; others that wait are taken too.
    fn receive(&mut self, wait: Duration) -> Result<bool, BusError> {
        let mut wait = wait;
        let mut came = false;
        while let Some(length) = self
            .socket
            .receive(&mut self.frame, wait)
            .map_err(BusError::Network)?
        {
            // A frame whose request was given up is nobody's.
            let taken = self
                .frame
                .get(..length)
                .map(|frame| self.rx.receive_frame(frame));
            came |= matches!(taken, Some(Ok(_)));
            wait = Duration::ZERO;
        }
        Ok(came)
    }
}
