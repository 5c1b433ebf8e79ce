//! Harness of the tests: scenes from text or file, their renders and rays, statistics, and the names that most tests use.
#![allow(dead_code, unused_imports, reason = "each of the two test programs uses a part")]

mod numbers;
mod png_file;
mod rays;
mod renders;
mod report;
mod samples;
mod statistics;
mod tables;
mod verdict;

pub use numbers::*;
pub use png_file::*;
pub use rays::*;
pub use renders::*;
pub use report::*;
pub use samples::*;
pub use statistics::*;
pub use tables::*;
pub use verdict::*;

pub use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
pub use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
pub use std::f64::consts::{PI, TAU};
pub use std::fmt::Write;
pub use std::fs;
pub use std::ops::Range;
pub use std::path::{Path, PathBuf};
pub use std::sync::atomic::{AtomicBool, Ordering};
pub use std::sync::{Arc, Mutex};
pub use std::time::{Duration, Instant};
pub use toml::{Table, Value};
pub use zerkalo_kernel::bvh::{Hit, Ray};
pub use zerkalo_kernel::lanes::{Double, Float, Frame, Mask, SimdFloat, Single, Vec3};
pub use zerkalo_kernel::primitive::{
    Aggregate, ConicalFrustumForm, ConvexPolyhedronForm, EllipsoidForm, Form, MeshForm,
    MeshNormals, PlaneForm, SphereForm, SurfacePoint,
};
pub use zerkalo_kernel::sampling::{SampleSettings, Sampler, SamplerKind};
pub use zerkalo_render::export::Provenance;
pub use zerkalo_render::film::file::FilmReader;
pub use zerkalo_render::film::testing::TestFilm;
pub use zerkalo_render::film::{Display, Film, Header, LightWeights, Replicates, TILE, Tile};
pub use zerkalo_render::plan::{Plan, PlanSettings};
pub use zerkalo_render::schedule::{Criterion, Settings, Step, Stop, StoppedBy};
pub use zerkalo_render::session::{Session, State};
pub use zerkalo_render::{Checkpoint, RenderState};
pub use zerkalo_scene::asset::Assets;
pub use zerkalo_scene::camera::{Aperture, Camera, Focus, Projection, ViewAngle};
pub use zerkalo_scene::disk::Existing;
pub use zerkalo_scene::edit::{SceneSettings, Target};
pub use zerkalo_scene::light::{
    Directional, Falloff, Light, LightKind, Point, RectangleLight, Spot,
};
pub use zerkalo_scene::material::{
    Bsdf, BsdfQuery, BsdfValue, Fresnel, Highlight, InterfaceQuery, Lobe, Masking, Material,
    ReflectionLobe,
};
pub use zerkalo_scene::shape::{CsgOperand, Cuboid, Cylinder, EXAMPLES, Shape, ShapeDesc};
pub use zerkalo_scene::value::{Color, Field, ValueType};
pub use zerkalo_scene::{
    Acceleration, AssetResolver, BelowHorizon, Document, FIELDS, Filter, Object, RayTypes, Scale,
    Scene, TransformOp, edit,
};
pub use zerkalo_scene::{TomlText, Tone};
pub use zerkalo_world as world;
pub use zerkalo_world::{AnyWorld, FirstHit, MAX_GROUPS, Options, Precision, Radiance, World};
