//! Cases with known answers, what is measured on them, and how: shared by the example and the test suite.

#![allow(dead_code, unreachable_pub, reason = "the example and the tests use different parts")]

pub mod case;
pub mod cases;
pub mod long_run;
pub mod mass;
pub mod measure;
pub mod random;
pub mod refusals;
pub mod row;
pub mod twin;
pub mod views;
