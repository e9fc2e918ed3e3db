//! A compiled model and its data: the one place that reads and writes MuJoCo's memory.
#![allow(unsafe_code)] // the functions and structures of a C library

use crate::inertial::PrincipalInertia;
use crate::layout::{contact, data, model};
use crate::library::{Data, Functions, Model, ObjectMotion, functions};
use crate::mjcf::placeholder;
use crate::{Integrator, MujocoError};
use phiw_dynamics::{Mat3, Placement, Spatial, Vec3};
use std::ffi::{CStr, CString, c_char};
use std::ptr::{NonNull, null};

/// Owns an `mjModel` and an `mjData`.
///
/// Invariant of all that follows: both pointers are those of a model that [`Simulation::new`] has checked,
/// nobody else has them, and the sizes are the model's.
pub(crate) struct Simulation {
    functions: &'static Functions,
    model: NonNull<Model>,
    data: NonNull<Data>,
    sizes: Sizes,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Sizes {
    pub positions: usize,
    pub velocities: usize,
    /// Without the world.
    pub bodies: usize,
}

// SAFETY: MuJoCo keeps nothing about a model or its data in threads; who owns them may use them from any one
// thread.
unsafe impl Send for Simulation {}

impl Drop for Simulation {
    fn drop(&mut self) {
        // SAFETY: made by the library, owned by us, and not used again.
        unsafe {
            (self.functions.mj_deleteData)(self.data.as_ptr());
            (self.functions.mj_deleteModel)(self.model.as_ptr());
        }
    }
}

/// MuJoCo's name for the frames of bodies (`mjOBJ_XBODY`), as against those of their inertias.
const BODY_FRAME: i32 = 2;

/// A model that nobody owns yet.
struct Compiled(&'static Functions, NonNull<Model>);

impl Drop for Compiled {
    fn drop(&mut self) {
        // SAFETY: made by the library, owned by us, and not used again.
        unsafe { (self.0.mj_deleteModel)(self.1.as_ptr()) };
    }
}

impl Simulation {
    /// Compiles the text and gives its bodies these inertias.
    pub fn new(mjcf: &str, sizes: Sizes, inertias: &[PrincipalInertia]) -> Result<Self, MujocoError> {
        let functions = functions()?;
        let compiled = compile(functions, mjcf)?;
        check_sizes(compiled.1, sizes)?;
        check_model(compiled.1, sizes)?;
        let mut simulation = Self::of_model(functions, compiled, sizes)?;
        simulation.set_inertias(inertias);
        Ok(simulation)
    }

    /// Compiles a text of somebody else's, which must have these sizes.
    pub fn of_text(mjcf: &str, sizes: Sizes) -> Result<Self, MujocoError> {
        let functions = functions()?;
        let compiled = compile(functions, mjcf)?;
        check_sizes(compiled.1, sizes)?;
        Self::of_model(functions, compiled, sizes)
    }

    fn of_model(
        functions: &'static Functions,
        compiled: Compiled,
        sizes: Sizes,
    ) -> Result<Self, MujocoError> {
        // SAFETY: a model that the library has just made.
        let data = NonNull::new(unsafe { (functions.mj_makeData)(compiled.1.as_ptr()) })
            .ok_or_else(|| MujocoError::Refused { message: "there is not enough memory".into() })?;
        let model = compiled.1;
        std::mem::forget(compiled); // handed over to the simulation
        let simulation = Simulation { functions, model, data, sizes };
        simulation.check_data()?;
        Ok(simulation)
    }

    /// Each body's true inertia, and what MuJoCo derives from it.
    fn set_inertias(&mut self, inertias: &[PrincipalInertia]) {
        for (index, inertia) in inertias.iter().enumerate() {
            let body = index + 1; // body 0 is the world
            // SAFETY: arrays of the model with one, three or four numbers for each body and the world, as
            // checked.
            unsafe {
                let array = |offset: usize| field::<*mut f64>(self.model.as_ptr(), offset).read();
                array(model::BODY_MASS).add(body).write(inertia.mass);
                array(model::BODY_IPOS).add(3 * body).cast::<[f64; 3]>().write(inertia.center);
                array(model::BODY_IQUAT).add(4 * body).cast::<[f64; 4]>().write(inertia.axes);
                array(model::BODY_INERTIA).add(3 * body).cast::<[f64; 3]>().write(inertia.moments);
            }
        }
        // SAFETY: the invariant.
        unsafe { (self.functions.mj_setConst)(self.model.as_ptr(), self.data.as_ptr()) };
    }

    /// The arrays lie in the data's own buffer, and hold what they must hold in the beginning.
    fn check_data(&self) -> Result<(), MujocoError> {
        let arrays = [
            ("qpos", data::QPOS, self.sizes.positions),
            ("qvel", data::QVEL, self.sizes.velocities),
            ("qacc", data::QACC, self.sizes.velocities),
            ("qacc_warmstart", data::QACC_WARMSTART, self.sizes.velocities),
            ("qfrc_applied", data::QFRC_APPLIED, self.sizes.velocities),
            ("qfrc_inverse", data::QFRC_INVERSE, self.sizes.velocities),
            ("xpos", data::XPOS, 3 * (self.sizes.bodies + 1)),
            ("xmat", data::XMAT, 9 * (self.sizes.bodies + 1)),
            ("subtree_com", data::SUBTREE_COM, 3 * (self.sizes.bodies + 1)),
            ("cfrc_int", data::CFRC_INT, 6 * (self.sizes.bodies + 1)),
        ];
        // SAFETY: fields inside the data, which the library made and whose version has been checked.
        let buffer = unsafe {
            Buffer::of(
                field::<usize>(self.data.as_ptr(), data::BUFFER).read(),
                field::<i64>(self.data.as_ptr(), data::NBUFFER).read(),
            )
        };
        arrays.into_iter().try_for_each(|(what, offset, length)| {
            // SAFETY: as above.
            let array = unsafe { field::<usize>(self.data.as_ptr(), offset).read() };
            buffer.check(what, array, length)
        })?;
        let still = self.velocity().iter().chain(self.numbers(data::QFRC_APPLIED, self.sizes.velocities));
        let neutral =
            self.sizes.positions == self.sizes.velocities || self.position()[3..7] == [1.0, 0.0, 0.0, 0.0];
        if still.copied().any(|x| x != 0.0) || !neutral {
            return Err(MujocoError::Layout { what: "mjData.qpos" });
        }
        Ok(())
    }

    fn numbers(&self, offset: usize, length: usize) -> &[f64] {
        // SAFETY: the field points to an array of at least this length that nobody else writes, as checked in
        // `check_data`.
        unsafe { std::slice::from_raw_parts(field::<*const f64>(self.data.as_ptr(), offset).read(), length) }
    }

    fn numbers_mut(&mut self, offset: usize, length: usize) -> &mut [f64] {
        // SAFETY: as for `numbers`; `self` is borrowed mutably.
        unsafe {
            std::slice::from_raw_parts_mut(field::<*mut f64>(self.data.as_ptr(), offset).read(), length)
        }
    }

    pub fn position(&self) -> &[f64] {
        self.numbers(data::QPOS, self.sizes.positions)
    }

    pub fn position_mut(&mut self) -> &mut [f64] {
        self.numbers_mut(data::QPOS, self.sizes.positions)
    }

    pub fn velocity(&self) -> &[f64] {
        self.numbers(data::QVEL, self.sizes.velocities)
    }

    pub fn velocity_mut(&mut self) -> &mut [f64] {
        self.numbers_mut(data::QVEL, self.sizes.velocities)
    }

    pub fn acceleration(&self) -> &[f64] {
        self.numbers(data::QACC, self.sizes.velocities)
    }

    pub fn acceleration_mut(&mut self) -> &mut [f64] {
        self.numbers_mut(data::QACC, self.sizes.velocities)
    }

    /// The acceleration from which the contact solver starts.
    pub fn warm_start_mut(&mut self) -> &mut [f64] {
        self.numbers_mut(data::QACC_WARMSTART, self.sizes.velocities)
    }

    pub fn applied_force_mut(&mut self) -> &mut [f64] {
        self.numbers_mut(data::QFRC_APPLIED, self.sizes.velocities)
    }

    /// What [`Self::inverse`] has found.
    pub fn inverse_force(&self) -> &[f64] {
        self.numbers(data::QFRC_INVERSE, self.sizes.velocities)
    }

    pub fn set_time_step(&mut self, dt: f64) {
        // SAFETY: a field inside the model, checked in `check_model`.
        unsafe { field::<f64>(self.model.as_ptr(), model::TIMESTEP).write(dt) };
    }

    pub fn set_integrator(&mut self, integrator: Integrator) {
        let number: i32 = match integrator {
            Integrator::RungeKutta4 => 1,
            Integrator::Implicit => 2,
        };
        // SAFETY: a field inside the model, checked in `check_model`.
        unsafe { field::<i32>(self.model.as_ptr(), model::INTEGRATOR).write(number) };
    }

    /// The force that the present position, velocity and acceleration need.
    pub fn inverse(&mut self) {
        // SAFETY: the invariant.
        unsafe { (self.functions.mj_inverse)(self.model.as_ptr(), self.data.as_ptr()) };
    }

    /// The acceleration under the applied force, and the contacts; `false` if the mass matrix is not positive
    /// definite.
    pub fn forward(&mut self) -> bool {
        let (model, data) = (self.model.as_ptr(), self.data.as_ptr());
        // SAFETY: the invariant; the count of warnings is a field inside the data.
        unsafe {
            let singular = field::<i32>(data, data::SINGULAR_COUNT);
            singular.write(0);
            (self.functions.mj_forward)(model, data);
            singular.read() == 0
        }
    }

    /// Goes on by one time step from what [`Self::forward`] has computed; `false` as there.
    pub fn integrate(&mut self, integrator: Integrator) -> bool {
        let (model, data) = (self.model.as_ptr(), self.data.as_ptr());
        // SAFETY: as in `forward`.
        unsafe {
            match integrator {
                Integrator::RungeKutta4 => (self.functions.mj_RungeKutta)(model, data, 4),
                Integrator::Implicit => (self.functions.mj_implicit)(model, data),
            }
            field::<i32>(data, data::SINGULAR_COUNT).read() == 0
        }
    }

    /// MuJoCo's own step, for benchmarks.
    pub fn step(&mut self) {
        // SAFETY: the invariant.
        unsafe { (self.functions.mj_step)(self.model.as_ptr(), self.data.as_ptr()) };
    }

    /// The accelerations of the bodies, for [`Self::body_acceleration`], in the motion of the last
    /// [`Self::inverse`].
    pub fn accelerate_bodies(&mut self) {
        // SAFETY: the invariant.
        unsafe { (self.functions.mj_rnePostConstraint)(self.model.as_ptr(), self.data.as_ptr()) };
    }

    /// Where the frame of a body is in the world, at the position of the last call.
    pub fn body_placement(&self, body: usize) -> Placement<f64> {
        let body = body + 1; // body 0 is the world
        let origin = &self.numbers(data::XPOS, 3 * (self.sizes.bodies + 1))[3 * body..];
        let turn = &self.numbers(data::XMAT, 9 * (self.sizes.bodies + 1))[9 * body..];
        Placement {
            rotation: Mat3(std::array::from_fn(|row| std::array::from_fn(|column| turn[3 * row + column]))),
            translation: Vec3(std::array::from_fn(|axis| origin[axis])),
        }
    }

    /// The velocity of a body's frame along its own axes.
    pub fn body_velocity(&self, body: usize) -> Spatial<f64> {
        self.object_motion(self.functions.mj_objectVelocity, body)
    }

    /// The acceleration of a body's frame, its origin's less gravity, along its own axes; after
    /// [`Self::accelerate_bodies`].
    pub fn body_acceleration(&self, body: usize) -> Spatial<f64> {
        self.object_motion(self.functions.mj_objectAcceleration, body)
    }

    fn object_motion(&self, function: ObjectMotion, body: usize) -> Spatial<f64> {
        let mut motion = [0.0; 6];
        let (model, data) = (self.model.as_ptr(), self.data.as_ptr());
        // SAFETY: the invariant; the body is one of the model's, and there is room for six numbers.
        unsafe { function(model, data, BODY_FRAME, self.number_of(body), motion.as_mut_ptr(), 1) };
        let [rx, ry, rz, x, y, z] = motion;
        Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) }
    }

    /// The motion of a body's frame, along the world's axes, that unit velocity of a coordinate gives it.
    /// Allocates.
    pub fn body_jacobian_column(&self, body: usize, coordinate: usize) -> Spatial<f64> {
        let size = self.sizes.velocities;
        let (mut linear, mut angular) = (vec![0.0; 3 * size], vec![0.0; 3 * size]);
        // SAFETY: the invariant; the body is one of the model's, and both matrices have three rows of `nv`
        // numbers.
        unsafe {
            (self.functions.mj_jacBody)(
                self.model.as_ptr(),
                self.data.as_ptr(),
                linear.as_mut_ptr(),
                angular.as_mut_ptr(),
                self.number_of(body),
            );
        }
        let column = |matrix: &[f64]| Vec3(std::array::from_fn(|row| matrix[row * size + coordinate]));
        Spatial { linear: column(&linear), angular: column(&angular) }
    }

    /// MuJoCo's number of a body, the world being its first.
    fn number_of(&self, body: usize) -> i32 {
        assert!(body < self.sizes.bodies, "there is no such body");
        body as i32 + 1
    }

    /// The wrench that each root body gets through its joint, in the motion of the last call, summed: force
    /// and moment about the world's origin.
    pub fn joint_wrench(&mut self, roots: impl Iterator<Item = usize>) -> [f64; 6] {
        self.accelerate_bodies();
        let centers = self.numbers(data::SUBTREE_COM, 3 * (self.sizes.bodies + 1));
        let wrenches = self.numbers(data::CFRC_INT, 6 * (self.sizes.bodies + 1));
        let mut total = [0.0; 6];
        for root in roots {
            let body = root + 1;
            let [mx, my, mz, fx, fy, fz] = std::array::from_fn(|i| wrenches[6 * body + i]);
            // MuJoCo takes moments about the centre of mass of the robot's part below this root.
            add_at(&mut total, std::array::from_fn(|i| centers[3 * body + i]), [fx, fy, fz]);
            [mx, my, mz].iter().enumerate().for_each(|(axis, moment)| total[3 + axis] += moment);
        }
        total
    }

    /// Adds the wrenches of all contacts of the last [`Self::forward`] on the robot to those of its feet:
    /// force and moment about the world's origin. `feet_of_shapes` says to which foot each shape belongs, the
    /// floor (the first shape) left out.
    pub fn add_contact_wrenches(&self, feet_of_shapes: &[usize], feet: &mut [[f64; 6]]) {
        let data = self.data.as_ptr();
        // SAFETY: fields inside the data; the contacts are an array of `ncon` structures.
        let (count, contacts) = unsafe {
            (field::<i32>(data, data::NCON).read(), field::<*const u8>(data, data::CONTACT).read())
        };
        for index in 0..count {
            let mut force = [0.0; 6];
            // SAFETY: the index is below `ncon`, the result has six elements, and the structure is of this
            // size.
            let (frame, point, shapes) = unsafe {
                (self.functions.mj_contactForce)(self.model.as_ptr(), data, index, force.as_mut_ptr());
                let this = contacts.add(index as usize * contact::SIZE);
                (
                    this.add(contact::FRAME).cast::<[[f64; 3]; 3]>().read(),
                    this.add(contact::POS).cast::<[f64; 3]>().read(),
                    this.add(contact::GEOM).cast::<[i32; 2]>().read(),
                )
            };
            // The floor is a plane, and so the first of the two.
            let sole = usize::try_from(shapes[1] - 1).ok().and_then(|shape| feet_of_shapes.get(shape));
            let Some(foot) = sole.and_then(|&foot| feet.get_mut(foot)) else { continue };
            // The rows of the frame are its axes; the first points from the floor up.
            let along = |axis: usize| (0..3).map(|row| frame[row][axis] * force[row]).sum();
            add_at(foot, point, [along(0), along(1), along(2)]);
        }
    }
}

/// Adds a force at a point to a wrench about the origin.
fn add_at(wrench: &mut [f64; 6], [x, y, z]: [f64; 3], [fx, fy, fz]: [f64; 3]) {
    let added = [fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx];
    wrench.iter_mut().zip(added).for_each(|(sum, added)| *sum += added);
}

/// A field of a structure.
///
/// # Safety
/// The structure has a `T` at this offset.
unsafe fn field<T>(structure: *mut impl Sized, offset: usize) -> *mut T {
    // SAFETY: the caller's word.
    unsafe { structure.cast::<u8>().add(offset).cast() }
}

/// The block of memory in which all arrays of a structure lie.
struct Buffer {
    start: usize,
    end: usize,
}

impl Buffer {
    fn of(start: usize, bytes: i64) -> Self {
        Buffer { start, end: start.saturating_add(usize::try_from(bytes).unwrap_or(0)) }
    }

    /// An error unless `length` numbers at `array` are inside.
    fn check(&self, what: &'static str, array: usize, length: usize) -> Result<(), MujocoError> {
        let inside = array >= self.start && array.saturating_add(length * size_of::<f64>()) <= self.end;
        if inside && array.is_multiple_of(align_of::<f64>()) {
            Ok(())
        } else {
            Err(MujocoError::Layout { what })
        }
    }
}

fn compile(functions: &'static Functions, mjcf: &str) -> Result<Compiled, MujocoError> {
    let refused = |message: String| MujocoError::Refused { message };
    let text = CString::new(mjcf).map_err(|_| refused("a joint's name contains a zero byte".into()))?;
    let mut error = [0 as c_char; 1024];
    // SAFETY: a text that ends with zero, and a buffer with its length; the other pointer may be null.
    let spec = unsafe {
        (functions.mj_parseXMLString)(text.as_ptr(), null(), error.as_mut_ptr(), error.len() as i32)
    };
    if spec.is_null() {
        // SAFETY: MuJoCo ends the message with zero, and the last element is zero from the beginning.
        return Err(refused(unsafe { CStr::from_ptr(error.as_ptr()) }.to_string_lossy().into_owned()));
    }
    // SAFETY: the specification has just been made, and is deleted once; the message is copied before.
    unsafe {
        let compiled = NonNull::new((functions.mj_compile)(spec, null())).ok_or_else(|| {
            let message = (functions.mjs_getError)(spec);
            refused(if message.is_null() {
                "it does not say why".into()
            } else {
                CStr::from_ptr(message).to_string_lossy().into_owned()
            })
        });
        (functions.mj_deleteSpec)(spec);
        Ok(Compiled(functions, compiled?))
    }
}

/// The model has the coordinates and bodies that it should have.
fn check_sizes(compiled: NonNull<Model>, sizes: Sizes) -> Result<(), MujocoError> {
    let structure = compiled.as_ptr();
    // SAFETY: numbers inside the model, which the library made and whose version has been checked.
    let size = |offset| unsafe { field::<i64>(structure, offset).read() as usize };
    let check = |what, right: bool| if right { Ok(()) } else { Err(MujocoError::Layout { what }) };
    check("mjModel.nq", size(model::NQ) == sizes.positions)?;
    check("mjModel.nv", size(model::NV) == sizes.velocities)?;
    check("mjModel.nbody", size(model::NBODY) == sizes.bodies + 1)
}

/// The fields of the model hold what this crate's text has put into them: its time step, and the inertias
/// that no other text has.
fn check_model(compiled: NonNull<Model>, sizes: Sizes) -> Result<(), MujocoError> {
    let structure = compiled.as_ptr();
    let check = |what, right: bool| if right { Ok(()) } else { Err(MujocoError::Layout { what }) };
    // SAFETY: numbers inside the model, which the library made and whose version has been checked; the arrays
    // are read only once they are known to lie inside the model's own buffer.
    unsafe {
        let time_step = field::<f64>(structure, model::TIMESTEP).read();
        check("mjModel.opt.timestep", time_step == placeholder::TIME_STEP)?;
        check("mjModel.opt.integrator", field::<i32>(structure, model::INTEGRATOR).read() == 1)?;
        let bytes = field::<i64>(structure, model::NBUFFER).read();
        let buffer = Buffer::of(field::<usize>(structure, model::BUFFER).read(), bytes);
        let array = |what, offset, each| -> Result<&[f64], MujocoError> {
            let array = field::<usize>(structure, offset).read();
            buffer.check(what, array, each * (sizes.bodies + 1))?;
            Ok(std::slice::from_raw_parts(array as *const f64, each * (sizes.bodies + 1)))
        };
        let masses = array("mjModel.body_mass", model::BODY_MASS, 1)?;
        let centers = array("mjModel.body_ipos", model::BODY_IPOS, 3)?;
        let axes = array("mjModel.body_iquat", model::BODY_IQUAT, 4)?;
        let moments = array("mjModel.body_inertia", model::BODY_INERTIA, 3)?;
        for body in 0..sizes.bodies {
            // Bodies come in the order of the text, which is the tree's.
            check("mjModel.body_mass", masses[body + 1] == placeholder::mass(body))?;
            check("mjModel.body_ipos", centers[3 * body + 3..][..3] == placeholder::CENTER)?;
            check("mjModel.body_iquat", axes[4 * body + 4..][..4] == placeholder::AXES)?;
            let mut sorted = [0.0; 3];
            sorted.copy_from_slice(&moments[3 * body + 3..][..3]);
            check("mjModel.body_inertia", sorted == placeholder::MOMENTS)?;
        }
    }
    Ok(())
}
