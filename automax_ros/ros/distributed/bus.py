"""The bus of a distributed rack: topics that the processes of one rack exchange.

Each process publishes and subscribes to ``bus`` (automax_msgs/BusWrite: its writes to common memory), ``bus/image``
(automax_msgs/BusImage: the memory it holds, on request) and ``bus/presence`` (automax_msgs/Presence every 20 ms, with
manual liveliness). The processes find each other by these topics in the rack's namespace; the process with
common memory sets the start when all are present. Messages of other runs are rejected and counted.

``begin`` is called when the start is known; before that nothing is written to the rack.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from automax_msgs.msg import BusImage as BusImageClass
from automax_msgs.msg import BusWrite as BusWriteClass
from automax_msgs.msg import Presence as PresenceClass
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.qos import LivelinessPolicy, QoSProfile, ReliabilityPolicy

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UserError
from automax_ros.messages.bus.bus import (
    AHEAD_NS,
    BUS,
    LONGEST_RUN_NS,
    BusLimits,
    batch_of,
    image_message,
    image_of,
    stop_state_of,
    with_stop_state,
    write_message,
)
from automax_ros.messages.bus.peers import BEAT_NS, Peer, Peers, PresenceVerdict
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import BusImage, BusWrite, Presence, Stage
from automax_ros.rack.base.part import RackPart
from automax_ros.rack.distributed.image_sync import Batch, ImageCopy, ImageSync
from automax_ros.rackfile.model.config import ModuleLoss
from automax_ros.rackfile.processes import part_name
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.base.qos import ros_qos
from automax_ros.ros.distributed.bus_topics import BusTopic, Terms
from automax_ros.ros.distributed.process_watch import ProcessWatch, this_host
from automax_ros.ros.distributed.recorder_wait import RecorderWait
from automax_ros.runtime.health import FROM_STRANGERS

LEASE_NS = 100 * NS_PER_MS
"""Liveliness lease of a process's presence, for observers outside the rack."""
ALONE_NS = 3500 * NS_PER_MS
"""Common memory's process without a run begins one after seeing no other for this long: discovery takes up to 3 s."""
LEAD_NS = 400 * NS_PER_MS
"""Time from the moment at which all processes are present to the start, so that all learn of it before."""
ANSWER_NS = 100 * NS_PER_MS
"""An image is sent to the same process at most this often."""
MOST_BYTES = 64 << 20
"""Longest image that is read; writes and presences may have a hundredth of it."""
BATCHES_A_ROUND = 32
"""Most batches that the intake takes per round: seven processes send 1000 per second, and on a busy host it is late."""
BATCHES_FIRST = 64
"""Most batches that are taken when a presence announces batches that have not arrived."""
MODULE_LOST = "31"
"""The hardware's code when a module does not answer on the backplane: bus error (decision: so is one that is lost)."""
PRESENCE = "bus/presence"
FOR_ALL = 0
"""``asked_by`` of an unrequested image: the last writes of a lost process, which some processes may not have."""


class ProcessAlreadyRuns(UserError):
    """Another process of this run has the same modules."""


@dataclass(frozen=True)
class ProcessLayout:
    """How a rack is divided into processes.

    ``processes`` are the slots of each, ``run_id`` the number of the run, 0 to join the present one. ``is_common`` is
    whether the current action happens in every process independently, as stimuli do. ``start_delay_ns`` is the time
    from the moment at which all are present to the start; that of common memory's process counts.
    ``awaits_recorder``: wait for a recorder that has subscribed to this process.
    """

    processes: Sequence[tuple[int, ...]]
    run_id: int = 0
    is_common: Callable[[], bool] = lambda: False
    start_delay_ns: int = LEAD_NS
    awaits_recorder: bool = False


class DistributedMemory:
    """One process's connection to the bus. ``fault`` is the reason why the process cannot take part, else None.

    ``process_slots`` are the slots of each process by the slot that names it, ``plants`` has that slot for each plant
    and web.
    """

    def __init__(self, rack_context: RackContext, nodes: Sequence[ModuleNode], process_layout: ProcessLayout) -> None:
        """Join the bus by the first of the process's nodes.

        Raises:
            ValueError: the rack's part is not one of the processes.
        """
        rack, processes = rack_context.rack, process_layout.processes
        own = next((slots for slots in processes if set(slots) == rack.part.slots), None)
        if own is None:
            raise ValueError(f"slots {sorted(rack.part.slots)} are not a process of rack {rack.config.name}")
        node = nodes[0]
        self._rack_context, self._rack, self._node = rack_context, rack, node
        self.process_slots = {min(slots): tuple(slots) for slots in processes}
        self._limits = BusLimits(self.process_slots)
        self.plants: dict[str, int] = {}
        for slot, slots in self.process_slots.items():
            part = RackPart.of(rack.config, slots)
            self.plants |= {plant.name: slot for plant in part.plants} | {web.name: slot for web in part.webs}
        process = int.from_bytes(os.urandom(8), "big") >> 1 or 1
        self._watch, self._lead_ns = ProcessWatch(), process_layout.start_delay_ns
        self.peers = Peers(process, min(own), own, rack.installed, process_layout.run_id, lives=self._watch.lives)
        self.link = ImageSync(rack, min(own), self._send, process_layout.is_common, self._run_guarded)
        self._recorder = RecorderWait(rack_context, nodes, PRESENCE) if process_layout.awaits_recorder else None
        self.stage, self.joining = Stage.JOINING, False
        self.fault: ProcessAlreadyRuns | None = None
        self._texts = frozenset(v for v, spec in enumerate(rack.memory.specs) if spec.type is DataType.STRING)
        self._begun = self._has_image = False
        self._waiting: list[Callable[[], None]] = []
        self._last_sent: dict[int, int] = {}
        self._participants: dict[int, bytes] = {}
        self._since_ns = time.monotonic_ns()
        qos = ros_qos(BUS)
        self._writes = node.create_publisher(BusWriteClass, "bus", qos)
        self._images = node.create_publisher(BusImageClass, "bus/image", qos)
        self._presences = node.create_publisher(PresenceClass, PRESENCE, presence_qos())
        writes = Terms(MOST_BYTES // 100, BATCHES_A_ROUND)
        terms = Terms(MOST_BYTES // 100, then=self._take_missing)
        self._write_topic = self._subscribe("bus", qos, BusWrite, self._take_write, writes)
        self._subscribe("bus/image", qos, BusImage, self._take_image, Terms(MOST_BYTES))
        self._subscribe(PRESENCE, presence_qos(), Presence, self._take_presence, terms)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(BEAT_NS / NS_PER_S, node.guarded_callback("the bus", self._beat), clock=steady)

    @property
    def run_id(self) -> int:
        """The number of the run, 0 while it is unknown."""
        return self.peers.run_id

    @property
    def epoch_ns(self) -> int:
        """The wall clock at rack time 0, ns; 0 while the start is unknown."""
        return self.peers.epoch_ns if self.stage is Stage.RUNNING else 0

    @property
    def missing(self) -> list[str]:
        """The absent processes, by their first modules; if all are present, the recorder that is awaited."""
        there = {*self.peers.by_slot, self.peers.process_slot}
        found = [part_name(self._rack.config, slots) for slot, slots in self.process_slots.items() if slot not in there]
        return found or ([] if self._recorder is None else ["the recorder"])

    @property
    def lost(self) -> list[str]:
        """The processes that were lost and have not come back."""
        return [
            part_name(self._rack.config, self.process_slots[slot])
            for slot in sorted(self.peers.lost & set(self.process_slots))
        ]

    def begin(self) -> None:
        """Apply the messages received before the start; call it as soon as the rack was started."""
        self.link.starting = False
        self._begun = True
        waiting, self._waiting = self._waiting, []
        for take in waiting:
            take()

    def catch_up(self) -> None:
        """Apply the image and the operating state of a running rack; call it between presets and the start of tasks."""
        waiting, self._waiting = self._waiting, []
        for take in waiting:
            take()
        for peer in self.peers.running():
            self.link.adopt(stop_state_of(peer.presence))

    def leave(self) -> None:
        """Announce that this process ends normally."""
        self.link.take_waiting()
        self.stage = Stage.LEAVING
        self._run_guarded(self._publish_presence)
        self._watch.close()

    # outgoing messages

    def _send(self, batch: Batch) -> None:
        self._writes.publish(encode(write_message(batch, self.run_id, self.peers.process)))

    def _publish_presence(self, asks: int = 0) -> None:
        peers = self.peers
        presence = Presence(
            time.time_ns(),
            self._rack.config.name,
            peers.run_id,
            peers.process,
            peers.process_slot,
            tuple(sorted(peers.slots)),
            peers.fingerprint,
            int(self.stage),
            self.epoch_ns,
            self.link.sequence,
            asks,
        )
        presence = presence._replace(host=this_host(), pid=os.getpid())
        self._presences.publish(encode(with_stop_state(presence, self.link.standing)))

    def _send_image(self, asked_by: int) -> None:
        now = time.monotonic_ns()
        if not self._begun or now - self._last_sent.get(asked_by, -ANSWER_NS) < ANSWER_NS:
            return
        self._last_sent = {process: at for process, at in self._last_sent.items() if now - at < ANSWER_NS}
        self._last_sent[asked_by] = now
        self._publish_image(self.link.picture(), asked_by)

    def _publish_image(self, picture: ImageCopy, asked_by: int) -> None:
        message = image_message(picture, self._rack.now_ns, self.run_id, self.peers.process, asked_by)
        self._images.publish(encode(message))

    # what each beat does

    def _beat(self) -> None:
        now = time.monotonic_ns()
        for peer in self.peers.look(now):
            self._handle_lost(peer)
        if self.stage in (Stage.JOINING, Stage.READY):
            self._advance(now)
        self._publish_presence(self._process_to_request())

    def _advance(self, now: int) -> None:
        peers = self.peers
        if (
            not peers.run_id
            and self._rack.part.holds_common_memory
            and not peers.by_slot
            and now - self._since_ns > ALONE_NS
        ):
            peers.run_id = int.from_bytes(os.urandom(8), "big") >> 1 or 1
        if not peers.run_id and self._rack.part.holds_common_memory and peers.by_slot and not any(peers.running()):
            peers.run_id = int.from_bytes(os.urandom(8), "big") >> 1 or 1
        if self._recorder is not None and self._recorder.is_over():
            self._recorder = None
        starting = peers.epoch_ns > time.time_ns()
        if any(peers.running()):
            if starting and self.stage is Stage.READY:
                self.stage = Stage.RUNNING
            elif self._has_image:
                self.joining, self.stage = True, Stage.RUNNING
        elif not self.missing and peers.run_id:
            self.stage = Stage.READY
            others = [peer.stage == Stage.READY for peer in peers.by_slot.values()]
            if self._rack.part.holds_common_memory and all(others):
                peers.epoch_ns = time.time_ns() + self._lead_ns
                self.stage = Stage.RUNNING

    def _process_to_request(self) -> int:
        """Return the process to request an image from, 0 for none."""
        running = next(self.peers.running(), None)
        # A process that is ready, but learned of the start too late, joins as a later one does.
        if self.stage in (Stage.JOINING, Stage.READY) and running is not None and not self._has_image:
            return running.process
        owing = self.peers.owing() if self._begun else None
        return owing.process if owing is not None else 0

    def _handle_lost(self, peer: Peer) -> None:
        self._watch.forget(peer.process)
        self._participants.pop(peer.process, None)
        name = part_name(self._rack.config, peer.presence.slots)
        text = f"{name} is lost: its process ended or no longer responds"
        self._rack_context.health.note("lost process", (name, peer.process), lambda: text)
        self._node.get_logger().error(text)
        if self._begun:
            self._publish_image(self.link.last_of(peer.presence.seat), FOR_ALL)
        operations = self._rack.operations
        stops = self._rack.config.on_module_loss is ModuleLoss.STOP_ALL
        if stops and self._begun and operations.powered and operations.stopped is None:
            operations.stop_all(text, MODULE_LOST)

    # incoming messages

    def _subscribe(
        self, topic: str, qos: QoSProfile, kind: Any, receive: Callable[[Any, bytes], None], terms: Terms
    ) -> BusTopic:
        return BusTopic(self._node, topic, f"automax_msgs/msg/{kind.__name__}", qos, receive, self._refuse, terms)

    def _run_guarded(self, take: Callable[[], None]) -> None:
        try:
            take()
        except Exception as error:
            self._node.guard.report("the bus", error)

    def _refuse(self, topic: str, what: str) -> None:
        self._rack_context.health.note(
            "refused bus message", (topic, what[:40]), lambda: f"{topic}: {what} was refused", most=FROM_STRANGERS
        )

    def _take_write(self, message: BusWrite, sender: bytes) -> None:
        if message.process == self.peers.process:
            return
        peer = self._peer(message, sender)
        if peer is None or message.seat != peer.presence.seat:
            self._refuse("bus", "a write of a process that is not of this run")
            return
        wrong = self._limits.of_write(message, self._latest_ns())
        if wrong:
            self._refuse("bus", wrong)
            return
        peer.got(message.sequence)
        batch = batch_of(message, self._texts)
        self._when_begun(lambda: self.link.receive(batch))

    def _take_image(self, message: BusImage, sender: bytes) -> None:
        peer = self._peer(message, sender)
        if peer is None or message.asked_by not in (FOR_ALL, self.peers.process):
            return
        wrong = self._limits.of_image(message, self._latest_ns())
        if wrong:
            self._refuse("bus/image", wrong)
            return
        picture = image_of(message, self._texts)
        if message.asked_by != FOR_ALL:
            peer.caught_up(message.sequence)
            self._has_image = True
        self._when_begun(lambda: self.link.merge(picture))

    def _latest_ns(self, given_epoch_ns: int = 0) -> int:
        epoch_ns = self.peers.epoch_ns or given_epoch_ns
        passed_ns = time.time_ns() - epoch_ns if epoch_ns else LONGEST_RUN_NS
        return max(self._rack.now_ns, passed_ns) + AHEAD_NS

    def _peer(self, message: BusWrite | BusImage, sender: bytes) -> Peer | None:
        """Return the process that a message names; None if it is not of this run, or not the sender."""
        if message.run_id != self.run_id or self._participants.get(message.process, sender) != sender:
            return None
        return self.peers.of(message.process)

    def _take_presence(self, presence: Presence, sender: bytes) -> None:
        if self._participants.get(presence.process, sender) != sender:
            self._refuse(PRESENCE, "a word in another process's name")
            return
        wall_ns = time.time_ns()
        wrong = self._limits.of_presence(presence, wall_ns, self._latest_ns(presence.epoch_ns))
        if wrong and presence.fingerprint == self.peers.fingerprint and presence.process != self.peers.process:
            self._refuse(PRESENCE, wrong)
            return
        found = self.peers.receive(presence, time.monotonic_ns())
        if found is PresenceVerdict.OWN:
            return
        if found not in (PresenceVerdict.KNOWN, PresenceVerdict.NEW):
            self._report_stranger(found, presence)
            return
        if found is PresenceVerdict.NEW:
            self._participants[presence.process] = sender
        if presence.asks == self.peers.process:
            self._send_image(presence.process)
        if self._begun and presence.run_id == self.run_id:
            self.link.adopt(stop_state_of(presence))

    def _take_missing(self, presence: Presence) -> None:
        """Take the batches that wait on the bus, before those that a presence announced count as missing.

        On a busy host they only wait here, and requesting an image each time would make it busier.
        """
        with self._rack_context.lock:
            is_short = self.peers.is_short(presence)
        if is_short and not all(self._write_topic.take() for _ in range(BATCHES_FIRST)):
            with self._rack_context.lock:
                self.peers.missed(presence, time.monotonic_ns())

    def _report_stranger(self, found: PresenceVerdict, presence: Presence) -> None:
        name = part_name(self._rack.config, presence.slots)
        if found is PresenceVerdict.SLOT_TAKEN and self.stage is Stage.JOINING and presence.state == Stage.RUNNING:
            self.fault = ProcessAlreadyRuns(
                f"{name} of this run is there already", "stop it first, or leave it as it is"
            )
        name_of_rack = self._rack.config.name
        texts = {
            PresenceVerdict.OTHER_RUN: f"another rack is called {name_of_rack}: its {name} is not of this run",
            PresenceVerdict.OTHER_FILE: f"{name} has another rack file or other sources: it is not of this run",
            PresenceVerdict.SLOT_TAKEN: f"a second process has {name}",
        }
        self._rack_context.health.note(
            "other rack", (found, presence.process), lambda: texts[found], most=FROM_STRANGERS
        )

    def _when_begun(self, take: Callable[[], None]) -> None:
        if self._begun:
            take()
        else:
            self._waiting.append(take)


def presence_qos() -> QoSProfile:
    """Return the quality of service of presences."""
    return QoSProfile(
        depth=10,
        reliability=ReliabilityPolicy.RELIABLE,
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(nanoseconds=LEASE_NS),
    )
