"""Holds a vehicle in Drake with adaptive_pd.fmu: pip install fmpy drake, `python examples/drake_rov.py`.

The controller is a system with a periodic update; it and the water press on a free body. Axes are the controller's.
"""

import sys

import numpy as np
import pydrake.all as drake
from verdict import told

from fmu import Fmu

STEP = 0.03
DRAG, CURRENT = np.array([130.0, 195.0, 286.0, 4.8, 9.8, 10.2]), np.array([0.12, 0.05, 0.0])


class Thrusters(drake.LeafSystem):
    """The FMU every 30 ms, and what it and the water press on the body: thrust, buoyancy of 20 N, drag."""

    def __init__(self, controller, body):
        super().__init__()
        self.controller, self.body, self.rows = controller, body, []
        r, d = (np.reshape([controller[f"thruster[{i}].{key}"] for i in range(1, 9)], (8, 3)) for key in "rd")
        self.wrenches = np.column_stack([d, np.cross(r, d)]).T
        self.DeclareVectorInputPort("state", 13)
        self.DeclareDiscreteState(8)
        self.DeclarePeriodicDiscreteUpdateEvent(STEP, 0.0, self.sample)
        forces = drake.Value[list[drake.ExternallyAppliedSpatialForce]]
        self.DeclareAbstractOutputPort("forces", forces, self.forces)

    def _state(self, context):
        state = self.get_input_port().Eval(context)
        return state, drake.RotationMatrix(drake.Quaternion(state[:4] / np.linalg.norm(state[:4])))

    def sample(self, context, discrete_state):
        """Take the pose, step the FMU, hold its forces."""
        state, rotation = self._state(context)
        angles = drake.RollPitchYaw(rotation).vector()
        self.controller["eta_m"] = [*state[4:7], *angles]
        self.rows.append([self.controller.step(), *state[4:7], angles[2]])
        discrete_state.set_value(self.controller["u"])

    def forces(self, context, output):
        """Give the wrench at the body's origin, in world axes."""
        (state, rotation), u = self._state(context), context.get_discrete_state_vector().value()
        R = rotation.matrix()
        nu = np.concatenate([R.T @ (state[10:] - CURRENT), R.T @ state[7:10]])
        force, moment = np.split(self.wrenches @ u - DRAG * abs(nu) * nu, 2)
        righting = np.cross(R @ [0.0, 0.0, 0.05], [0.0, 0.0, 80.0 * 9.81])
        press = drake.ExternallyAppliedSpatialForce()
        press.body_index = self.body.index()
        press.F_Bq_W = drake.SpatialForce(R @ moment + righting, R @ force + [0.0, 0.0, 80.0 * 9.81 + 20.0])
        output.set_value([press])


builder = drake.DiagramBuilder()
plant, _ = drake.AddMultibodyPlantSceneGraph(builder, time_step=0.003)
body = plant.AddRigidBody(
    "rov", drake.SpatialInertia(80.0, np.zeros(3), drake.UnitInertia(3.7 / 80, 6.3 / 80, 5.9 / 80))
)
plant.Finalize()
with Fmu("adaptive_pd.fmu", step_size=STEP) as controller:
    controller["eta_m_valid"] = True
    thrusters = builder.AddSystem(Thrusters(controller, body))
    builder.Connect(plant.get_state_output_port(), thrusters.get_input_port())
    builder.Connect(thrusters.get_output_port(), plant.get_applied_spatial_force_input_port())
    simulator = drake.Simulator(builder.Build())
    start = [np.cos(0.5), 0, 0, np.sin(0.5), 0, 0.5, 0, *[0] * 6]  # yaw of 1 rad, y of 0.5 m
    plant.SetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_mutable_context()), start)
    simulator.AdvanceTo(84.0)
sys.exit(told(thrusters.rows, "drake_rov"))
