"""DC_DRIVE_CML: what its declaration says, against table 1 of the manual and what the loop takes and gives."""

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.drive.cml import INPUTS, OUTPUTS

BLOCK = CATALOGUE["DC_DRIVE_CML"]


def test_inputs_and_outputs_are_those_of_the_loop_in_its_order():
    assert tuple(item.name for item in BLOCK.inputs) == INPUTS
    assert tuple(item.name for item in BLOCK.outputs) == (*OUTPUTS, "DIAG_DATA")
