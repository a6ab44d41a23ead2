"""A small robot behind a UDP port, as somebody else would write it from docs/robots.md: imports nothing of airground.

    python udp_robot.py [--seconds 20] [--clock-zero 1000] [--drift-ppm 0]

prints its port, drives as it is told, tells of its motion 50 times a second, and stops by itself. For every command
that it takes it prints a line; so a test sees what reached it.
"""

from __future__ import annotations

import argparse
import json
import math
import socket
import time


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--seconds", type=float, default=20.0)
    options.add_argument("--clock-zero", type=float, default=1000.0)
    options.add_argument("--drift-ppm", type=float, default=0.0)
    o = options.parse_args()

    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.bind(("127.0.0.1", 0))
    line.settimeout(0.02)
    print("port", line.getsockname()[1], flush=True)

    began = time.monotonic()
    driver = None  # whom to answer
    v = omega = 0.0
    x = y = theta = 0.0
    newest, heard, timeout = 0, -1e9, 0.5
    last, due = 0.0, 0.0
    while (now := time.monotonic() - began) < o.seconds:
        try:
            text, sender = line.recvfrom(2048)
            told = json.loads(text)
            silent = now - heard > timeout
            if told["kind"] == "command" and (told["seq"] > newest or silent):
                newest, heard, driver = told["seq"], now, sender
                timeout = told["timeout_s"]
                v, omega = told["v_mps"], told["omega_radps"]
                print("told", newest, v, omega, flush=True)
        except TimeoutError:
            pass
        now = time.monotonic() - began
        if now - heard > timeout and (v or omega):
            v = omega = 0.0
            print("alone", flush=True)
        dt, last = now - last, now
        x += v * dt * math.cos(theta + omega * dt / 2)
        y += v * dt * math.sin(theta + omega * dt / 2)
        theta += omega * dt
        if driver is not None and now >= due:
            due = now + 0.02
            clock = o.clock_zero + now * (1 + o.drift_ppm * 1e-6)
            reading = {"t_s": clock, "heading_rad": theta, "speed_mps": v, "turn_rate_radps": omega}
            line.sendto(json.dumps(reading).encode(), driver)
    print("at", x, y, theta, flush=True)


if __name__ == "__main__":
    main()
