//! The process border: messages and channels over iceoryx2.
