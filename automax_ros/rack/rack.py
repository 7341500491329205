"""The rack: modules, common memory, tasks and their schedule, wired from a configuration. No ROS 2.

rack = Rack(config)
rack.start()
rack.run(10.0)      # ten simulated seconds
rack.value("SPEED_REF%")
rack.operations.stop("SPEED")
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import Element, NameFault
from automax_ros.core.ticks import seconds_ns
from automax_ros.core.types import Value
from automax_ros.drive.base.state import SavedState
from automax_ros.rack.base.local_names import LocalElement
from automax_ros.rack.base.observers import Observers, RackObserver
from automax_ros.rack.base.part import RackPart
from automax_ros.rack.base.stop_cause import OperationsState
from automax_ros.rack.base.views import backplane_of, view_specs
from automax_ros.rack.modules.drive import DriveControllerModule
from automax_ros.rack.modules.drive_io import DriveAnalogModule
from automax_ros.rack.modules.io_module import IoModule
from automax_ros.rack.modules.module import Module, ModuleState, ProcessorModule, QuietModule
from automax_ros.rack.modules.network import NetworkModule
from automax_ros.rack.modules.udc import UdcModule
from automax_ros.rack.operations.forces import Force, ForceTable, Target
from automax_ros.rack.operations.operations import Operations, begin_memory
from automax_ros.rack.operations.values import ValueOperations
from automax_ros.rack.plants import PlantFeeds, PlantSampling, RackPlants
from automax_ros.rack.tasks.installation import Finding, Installation, RackServices
from automax_ros.rack.tasks.scheduled_task import ScanEnd, ScheduledTask, TaskStatistics
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import full_speeds
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, WriterSpec, writers_of
from automax_ros.rackfile.modules.common_memory import CommonMemoryConfig
from automax_ros.rackfile.modules.drive import DriveAnalogConfig, DriveConfig
from automax_ros.rackfile.modules.io import IoConfig
from automax_ros.rackfile.modules.network import NetworkConfig
from automax_ros.rackfile.modules.processor import Pc3000Config, ProcessorConfig
from automax_ros.rackfile.modules.udc import UdcConfig
from automax_ros.runtime.memory.common_clock import CommonClock
from automax_ros.runtime.memory.memory import CommonMemory, ProcessInputs
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.drives import Drives
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.execution import IDEAL, Execution
from automax_ros.runtime.scan.modeled_execution import ModeledExecution
from automax_ros.runtime.tasks.interrupts import Interrupts
from automax_ros.runtime.tasks.task import EVENT_TIMEOUT, Task
from automax_ros.runtime.time.scheduler import Scheduler


def build_module(config: ModuleConfig, parts: RackServices) -> Module:
    """Return the module of a running rack for a configuration."""
    return _BUILDERS[type(config)](config, parts)


def _processor(config: ProcessorConfig, parts: RackServices) -> Module:
    in_order = sorted(config.tasks, key=lambda item: (item.priority, item.name))
    execution = parts.execution(config.name)
    return ProcessorModule(config, tasks=[parts.install(item, execution) for item in in_order])


def _drive(config: DriveConfig, parts: RackServices) -> Module:
    plant = None if config.plant is None else parts.plants.get(config.plant.name)
    full_rpm = None if config.plant is None else full_speeds(parts.config.feeds).get(config.plant.name)
    return DriveControllerModule(config, parts, plant, full_rpm)


def _drive_analog(config: DriveAnalogConfig, parts: RackServices) -> Module:
    module = DriveAnalogModule(config, parts)
    if config.drive is not None:
        parts.drives.wire_voltage(config.drive, module.show_voltage)
    return module


_BUILDERS: dict[type, Callable[[Any, RackServices], Module]] = {
    ProcessorConfig: _processor,
    Pc3000Config: _processor,
    CommonMemoryConfig: lambda config, _: QuietModule(config),
    IoConfig: IoModule,
    DriveConfig: _drive,
    DriveAnalogConfig: _drive_analog,
    NetworkConfig: NetworkModule,
    UdcConfig: UdcModule,
}


@dataclass(frozen=True)
class RackState:
    """All state on which the future of a rack depends, apart from its configuration and sources.

    ``image`` is (view, element, value) of all of memory, ``forced`` the forced elements, ``under_forces`` their values
    without the forces; ``events`` are kept for the next task that waits. ``modules`` by slot exclude their ``plants``.
    """

    now_ns: int
    image: tuple[tuple[int, int, Value], ...]
    forced: frozenset[tuple[int, int]]
    events: tuple[str, ...]
    channels: tuple[Any, ...]
    operations: OperationsState
    clock_since_ns: int | None
    modules: Mapping[int, ModuleState]
    plants: Mapping[str, SavedState] = field(default_factory=dict)
    under_forces: tuple[tuple[int, int, Value], ...] = ()


def digest_of(text: str, sources: Mapping[str, SourceText]) -> int:
    """Return a number of 63 bits that a rack's file and its sources determine."""
    digest = hashlib.sha256(text.encode())
    for name, source in sorted(sources.items()):
        digest.update(name.encode() + b"\0" + source.text.encode() + b"\0")
    return int.from_bytes(digest.digest()[:8], "big") >> 1


class Rack:
    """A running rack. ``stopwatch`` (ns, the pacer's clock) measures execution times; without one they count as 0.

    ``execution`` replaces the configured execution of scans in all modules (``scenario/stepper``). ``local`` are the
    slots whose modules are in this process (``rack/base/part``), all if None. ``installation`` has the tasks if they
    are compiled already; ``native`` selects which of them scan as machine code (``compile/native``).
    """

    def __init__(
        self,
        config: RackConfig,
        *,
        stopwatch: Callable[[], int] | None = None,
        execution: Execution | None = None,
        local: Collection[int] | None = None,
        installation: Installation | None = None,
        native: NativeForms = IN_PYTHON,
    ) -> None:
        """Compile the tasks against the rack's common memory and build the modules.

        Raises:
            RackError: a task has errors; nothing is started then (the hardware's E0).
        """
        self.config = config
        self.part = RackPart.of(config, local)
        self.memory = CommonMemory(view_specs(config.variables))
        self._forcing = ForceTable(config, self.memory, lambda: self.tasks)
        self.writers: tuple[WriterSpec, ...] = writers_of(config)
        self.scheduler = Scheduler()
        installation = installation or Installation(config, self.part.tasks, native=native)
        self.observers = Observers(self.memory)
        self.backplane = backplane_of(config)
        self.events = Events()
        self.channels = Channels()
        self.drives = Drives()
        self._interrupts = Interrupts(self.memory, self.events)
        self.inputs = ProcessInputs(self.memory, self.scheduler)
        self._clock = CommonClock(self.scheduler, self.memory, self._clock_fault)
        self.plants = RackPlants(self.part.plants, self.part.webs)
        self.sampling = PlantSampling(self.plants, self.scheduler)
        self._feeds = PlantFeeds(config, self.plants, self.memory, self.inputs, self.scheduler)
        services = RackServices(
            config=config,
            installation=installation,
            memory=self.memory,
            scheduler=self.scheduler,
            backplane=self.backplane,
            events=self.events,
            channels=self.channels,
            clock=self._clock,
            interrupts=self._interrupts,
            inputs=self.inputs,
            drives=self.drives,
            plants=self.plants,
            execution=self._execution if execution is None else lambda _: execution,
            after=ScanEnd(self.observers, self.inputs, self._stop_all).ended,
            no_event=self._no_event,
            report_writes=self.observers.report_writes,
            stopwatch=stopwatch,
        )
        self.modules: list[Module] = [build_module(module, services) for module in self.part.modules]
        self.operations = Operations(
            config,
            self.modules,
            installation,
            self.memory,
            self.scheduler,
            self.events,
            self.channels,
            self.observers,
            self._forcing,
            elsewhere=self.part.elsewhere(self.memory, self.backplane),
        )
        self.adjust = ValueOperations(
            config, self.operations, self.memory, self.inputs, self._forcing, self.observers, self.tune
        )

    @property
    def warnings(self) -> list[Finding]:
        """Warnings from the checks of the tasks."""
        return self.operations.installation.warnings

    @property
    def scheduled(self) -> list[ScheduledTask]:
        """All tasks with their events and statistics: by slot, then in starting order."""
        return [item for module in self.modules for item in module.tasks]

    @property
    def sources(self) -> dict[str, SourceText]:
        """The source that each task runs."""
        return {item.task.name: item.source for item in self.scheduled}

    @property
    def statistics(self) -> dict[str, TaskStatistics]:
        """The counts of each task."""
        return {item.task.name: item.statistics for item in self.scheduled}

    @property
    def task_modules(self) -> list[Module]:
        """The modules that run tasks."""
        return [module for module in self.modules if module.config.tick_ns]

    @property
    def stop_reason(self) -> str | None:
        """Why all tasks are stopped; None while the rack runs."""
        return self.operations.stop_reason

    @property
    def tasks(self) -> list[Task]:
        """All tasks: by slot, then in starting order."""
        return [item.task for item in self.scheduled]

    @property
    def clock_since_ns(self) -> int | None:
        """Since when the common clock of the backplane runs; None while it does not."""
        return self._clock.since_ns

    @property
    def now_ns(self) -> int:
        """Rack time: ns since the rack was started."""
        return self.scheduler.now_ns

    @property
    def installed(self) -> int:
        """A number of 63 bits that the rack's file and all sources determine, those of other processes too."""
        return digest_of(self.config.text, self.operations.installation.sources)

    @property
    def fingerprint(self) -> int:
        """A number of 63 bits that configuration and sources determine: the run's id unless another is given."""
        return digest_of(self.config.text, self.sources)

    def observe(self, observer: RackObserver) -> None:
        """Notify an observer from now on; keep scan records and the write log from now on too."""
        self.observers.add(observer)
        for task in self.tasks:
            task.record_scans()

    def start(self, settings: Sequence[tuple[str, Value]] = (), first: Callable[[], None] | None = None) -> None:
        """Write presets, then ``settings`` (name and value, as an operator would), and put all tasks into RUN.

        A name may be that of an array's element: ``TABLE%(3)``. ``first`` is called before the start-up parts run: it
        may write and operate the rack, as the stimuli of time 0 do.

        Scans start at once: the first of each task at this instant, then one each period.

        Raises:
            NameFault: a setting names a variable that the rack does not have.
            MemoryValueError: a setting's value does not fit.
        """
        self.memory.now_ns = self.now_ns
        begin_memory(self.config, self.inputs, self.memory)
        self.operations.write_status()
        self.set_from_start(settings)
        self.operations.start(first)
        self._begin_plants()

    def join(self, now_ns: int, catch_up: Callable[[], None]) -> None:
        """Join a rack that other processes run already: the first scans come at the next ticks.

        ``catch_up`` applies the values of the other processes, after the presets and before the tasks are put into RUN.
        """
        self.scheduler.run_due(now_ns)
        self.memory.now_ns = self.now_ns
        begin_memory(self.config, self.inputs, self.memory)
        self.operations.write_status()
        self.observers.report_writes()
        catch_up()
        self.operations.start(joining=True)
        self._begin_plants()

    def set_from_start(self, settings: Sequence[tuple[str, Value]]) -> None:
        """Write commons as an operator would, before any task runs.

        Raises:
            NameFault, MemoryValueError: as ``start``.
        """
        for name, value in settings:
            found = self.config.common(name)
            self.inputs.write_from_outside(self.memory.view(found.name), value, OPERATOR_WRITER, found.index)
        self.observers.report_writes()

    def run(self, seconds: float) -> None:
        """Advance simulated time."""
        self.scheduler.run_until(self.now_ns + seconds_ns(seconds))

    def write(self, name: str, value: Value, writer: int = OPERATOR_WRITER, element: int = 0) -> None:
        """Write a common from outside the tasks, between scans.

        Raises:
            KeyError: the rack has no such variable.
            MemoryValueError: the value does not fit the variable.
        """
        self.write_view(self.memory.view(name), [(element, value)], writer)

    def write_view(self, view: int, values: Sequence[tuple[int, Value]], writer: int) -> None:
        """Write elements of a variable from outside the tasks, between scans.

        Raises:
            MemoryValueError: a value does not fit; nothing is written then.
        """
        memory = self.memory
        accepted = [(element, memory.accepted(view, value, element)) for element, value in values]
        memory.now_ns = self.now_ns
        for element, value in accepted:
            self.inputs.write(view, element, value, writer)
        self.observers.report_writes()

    def force(self, name: str, value: Value, writer: int = OPERATOR_WRITER) -> None:
        """Hold a common, or a task's own variable (``SPEED.COUNT%``), at a value against every write, between scans.

        Raises:
            KeyError: the rack has no such variable.
            MemoryValueError: the value does not fit, as many are forced as the Executive allows, or it cannot
                be forced: a string, an array, a tunable, what the rack itself writes, or a register of which both the
                word and bits are named (J2-3106-1 p. 18-10).
        """
        self._change_force(name, lambda target: self._forcing.force(target, value, writer))

    def unforce(self, name: str, writer: int = OPERATOR_WRITER) -> None:
        """End a force; the value stays until the next write.

        Raises:
            KeyError: the rack has no such variable.
        """
        self._change_force(name, lambda target: self._forcing.release(target, writer))

    def _change_force(self, name: str, change: Callable[[Target], None]) -> None:
        try:
            target = self._forcing.local(name) if "." in name else Element(self.config.by_name[name])
        except NameFault as fault:
            raise KeyError(name) from fault
        self.memory.now_ns = self.now_ns
        change(target)
        self.observers.report_writes()
        if isinstance(target, LocalElement):
            self.observers.tuned(target.task, self.now_ns)

    def forces(self) -> list[Force]:
        """Return the force table: variables and the values they are held at, in the order of the rack file."""
        return self._forcing.table()

    def tune(self, task: Task, name: str, value: object) -> None:
        """Set a tunable of a task, between scans.

        Raises:
            KeyError: the task has no tunable of that name.
            ValueError: the value lies outside its limits or is not of its type.
        """
        task.tune(name, value)
        self.observers.tuned(task, self.now_ns)

    def value(self, name: str, element: int = 0) -> Value:
        """Return the present value of a common.

        Raises:
            KeyError: the rack has no such variable.
        """
        return self.memory.read_now(self.memory.view(name), element)

    def task(self, name: str) -> Task:
        """Return a task by name.

        Raises:
            KeyError: the rack has no such task.
        """
        for task in self.tasks:
            if task.name == name:
                return task
        raise KeyError(name)

    def state(self) -> RackState:
        """Return all state on which the future depends, between two scans."""
        return RackState(
            now_ns=self.now_ns,
            image=tuple(self.memory.image()),
            forced=self.memory.forced,
            events=self.events.pending,
            channels=self.channels.state(),
            operations=self.operations.state(),
            clock_since_ns=self._clock.since_ns,
            modules={module.config.slot: module.state() for module in self.modules},
            plants=self.plants.state(),
            under_forces=tuple(self.memory.under_forces),
        )

    def load(self, state: RackState) -> None:
        """Continue from a state of the same rack, in place of ``start``; all that follows is the same bit for bit.

        Raises:
            ValueError: the state is not one of this rack, or this rack has been started already.
        """
        if set(state.modules) != {module.config.slot for module in self.modules}:
            raise ValueError("the state is that of a rack with other modules")
        if self.scheduler.next_ns is not None:
            raise ValueError("this rack runs already: load the state into one that was not started")
        self.scheduler.run_until(state.now_ns)
        self.memory.load_image(state.image)
        self.memory.hold(state.forced, state.under_forces)
        self.operations.load(state.operations)
        self._clock.resume(state.clock_since_ns)
        self.channels.load(state.channels)
        self.plants.load(state.plants)
        for module in self.modules:
            module.load(state.modules[module.config.slot])
        self._forcing.load()
        self.events.load(state.events)
        self._begin_plants()

    def _begin_plants(self) -> None:
        self._feeds.begin(self.operations, self.observers)
        self.sampling.begin()

    def _execution(self, module: str) -> Execution:
        return ModeledExecution(self.scheduler, module) if self.config.execution is Timing.MODELED else IDEAL

    def _no_event(self, task: Task) -> None:
        next(item for item in self.scheduled if item.task is task).fault(EVENT_TIMEOUT)

    def _clock_fault(self, reason: str, code: str) -> None:
        if self.operations.powered:
            self.operations.stop_all(reason, code)

    def _stop_all(self, reason: str, code: str | None, task: str) -> None:
        self.operations.stop_all(reason, code, task)
