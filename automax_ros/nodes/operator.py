"""The node ``operator``: the services by which a rack is operated, only where its YAML says ``operator: true``.

Services, all in the rack's namespace: ``run``, ``stop``, ``clear`` (also ``clear_errors``), ``delete``
(automax_msgs/OperateTask), ``run_all``, ``stop_all``, ``pause``, ``resume`` (std_srvs/Trigger), ``step``
(automax_msgs/Step), ``power`` (automax_msgs/Power), ``set``, ``force``, ``tune`` (automax_msgs/SetValue), ``unforce``
(automax_msgs/Unforce), ``module``, ``plant`` (automax_msgs/OperateControl), ``reload`` (automax_msgs/Reload), ``get``,
``forces`` (automax_msgs/ReadValues), ``errors`` (automax_msgs/ReadErrors), ``tasks`` (automax_msgs/ReadTasks),
``status`` (automax_msgs/ReadStatus).

A request is carried out between two scans; the answer says whether, if not, why, and what is true now. Refusals are
counted in the rack's health.
"""

from __future__ import annotations

from automax_ros.nodes.module_node import ModuleNode, Site
from automax_ros.nodes.operator_desk import OperatorDesk


class OperatorNode(ModuleNode):
    """Serves the operator of one rack."""

    def __init__(self, site: Site) -> None:
        """Create the services."""
        super().__init__(site, "operator")
        self.desk = OperatorDesk(self)

    def destroy_node(self) -> None:
        """Leave the graph; a source that is being compiled is not installed."""
        self.desk.close()
        super().destroy_node()
