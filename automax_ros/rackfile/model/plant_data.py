"""Makes the plants of a running rack from its configuration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from automax_ros.drive.base.nameplate import derive
from automax_ros.drive.plant.coupling import CoupledPlants
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from automax_ros.rackfile.model.plants import PlantConfig


def build_plants(configs: Iterable[PlantConfig]) -> dict[str, DrivePlant]:
    """Return the plants that have a motor, by name, at rest."""
    found = ((config.name, plant_data(config)) for config in configs)
    return {name: DrivePlant(data) for name, data in found if data is not None}


def couple_plants(plants: Mapping[str, DrivePlant], configs: Iterable[PlantConfig]) -> dict[str, CoupledPlants]:
    """Couple plants at their start; return the couplings by the names of both, ``UNWIND+WINDER``.

    Raises:
        ParameterError: two plants cannot be coupled so.
    """
    return {
        f"{config.name}+{config.couple.to}": CoupledPlants(
            plants[config.name], plants[config.couple.to], config.couple.data
        )
        for config in configs
        if config.couple is not None
    }


def plant_data(config: PlantConfig) -> PlantData | None:
    """Return the data of a plant in SI units, None for one without a motor.

    Raises:
        ParameterError: the plate contradicts itself, or a value is beyond what can be simulated.
    """
    plate, supply, load = config.plate, config.supply, config.load
    if plate is None:
        return None
    if supply.v_ll is not None:
        plate = replace(plate, line_v=supply.v_ll)
    if supply.hz is not None:
        plate = replace(plate, line_hz=supply.hz)
    parameters = derive(plate)
    if supply.ls_mh is not None:
        parameters = replace(parameters, source_h=supply.ls_mh * 1e-3)
    data = PlantData(
        parameters,
        inertia=config.inertia,
        standard_rotation=supply.standard,
        load=LoadData(load.torque_nm, load.torque_per_rpm, load.friction_nm, load.speed_rpm),
    )
    return data if supply.rs_mohm is None else replace(data, resistance_ohm=supply.rs_mohm * 1e-3)
