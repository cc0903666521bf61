"""The controller of the tests: the echo server of RSIPI 0.3.0, which checks every answer.

    python serve.py ETHERNET_CONFIG PORT ANGLES

Sends to 127.0.0.1:PORT every 4 ms from joint angles in degrees, with commas; prints `ready`. A line
`count` on standard input prints how many answers were late or invalid and how many cycles there
were; a line `drop SECONDS` sends nothing for a while, as if the cable was pulled.
"""

import sys
import time

from RSIPI.rsi_echo_server import EchoServer


def main():
    config, port, angles = sys.argv[1], int(sys.argv[2]), sys.argv[3].split(",")
    server = EchoServer(config, delay_ms=4, mode="absolute")
    server.client_address = ("127.0.0.1", port)
    for state in (server.state, server.base_pose):
        for axis, angle in enumerate(angles, 1):
            state["AIPos"][f"A{axis}"] = float(angle)
    server.start()
    print("ready", flush=True)
    for line in sys.stdin:
        words = line.split()
        if words[:1] == ["count"]:
            cycles = (server.ipoc_value - server.first_ipoc) // server.ipoc_increment
            print(server.faulty_packets, cycles, flush=True)
        elif words[:1] == ["drop"]:
            real = server.udp_socket
            server.udp_socket = Deaf(real)
            time.sleep(float(words[1]))
            server.udp_socket = real
            print("back", flush=True)
    server.stop()


class Deaf:
    """A socket whose cable is pulled."""

    def __init__(self, real):
        self.real = real

    def sendto(self, *_):
        return 0

    def __getattr__(self, name):
        return getattr(self.real, name)


if __name__ == "__main__":
    main()
