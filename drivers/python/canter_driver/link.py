"""The driver's end of shared memory, over the `iceoryx2` wheel of version 0.9.3."""

import iceoryx2 as iox2

from . import domain
from . import messages as m


class Link:
    """The driver's end of shared memory."""

    def __init__(self, arm):
        iox2.set_log_level(iox2.LogLevel.Fatal)
        config = iox2.config.default()
        place = domain.directory()
        config.global_cfg.root_path = iox2.Path.new(place)
        config.global_cfg.prefix = iox2.FileName.new(domain.prefix(place))
        self.node = (
            iox2.NodeBuilder.new()
            .name(iox2.NodeName.new(f"driver of {arm}"))
            .config(config)
            .signal_handling_mode(iox2.SignalHandlingMode.Disabled)
            .create(iox2.ServiceType.Ipc)
        )
        self.states = self._topic(arm, "state", m.State).publisher_builder()
        self.states = self.states.backpressure_strategy(
            iox2.BackpressureStrategy.DiscardData
        ).create()
        self.setpoints = self._topic(arm, "setpoint", m.Setpoint).subscriber_builder().create()
        exchange = self.node.service_builder(iox2.ServiceName.new(f"{arm}/hello"))
        self.hello = (
            exchange.request_response(m.Hello, m.HelloAck)
            .enable_safe_overflow_for_requests(True)
            .enable_safe_overflow_for_responses(True)
            .max_active_requests_per_client(2)
            .max_response_buffer_size(2)
            .max_servers(1)
            .max_clients(8)
            .max_nodes(16)
            .open_or_create()
            .server_builder()
            .create()
        )

    def _topic(self, arm, kind, payload):
        return (
            self.node.service_builder(iox2.ServiceName.new(f"{arm}/{kind}"))
            .publish_subscribe(payload)
            .payload_alignment(iox2.Alignment.new(64))
            .enable_safe_overflow(True)
            .history_size(0)
            .subscriber_max_buffer_size(16)
            .subscriber_max_borrowed_samples(2)
            .max_publishers(1)
            .max_subscribers(8)
            .max_nodes(16)
            .open_or_create()
        )

    def send(self, state):
        self.states.send_copy(state)

    def next_setpoint(self):
        sample = self.setpoints.receive()
        if sample is None:
            return None
        setpoint = m.Setpoint.from_buffer_copy(sample.payload().contents)
        sample.delete()
        return setpoint
