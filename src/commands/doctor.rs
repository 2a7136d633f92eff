use super::Answer;
use crate::gpu::{Gpu, Shaders, adapters, how_to_get_an_adapter, is_software};
use crate::problem::{Cause, Problem, Problems};
use crate::session::Options;
use serde_json::json;

/// Say what this machine draws with, or what to install when there is nothing
#[derive(clap::Args)]
pub struct Doctor {}

impl Doctor {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let found = adapters();
        if found.is_empty() {
            return Err(Problem::new(Cause::Adapter, "there is no graphics adapter")
                .hint(how_to_get_an_adapter())
                .into());
        }
        let gpu = Gpu::open(options.adapter.as_deref())?;
        let mut text = String::new();
        let mut facts = Vec::new();
        for adapter in &found {
            let info = adapter.get_info();
            let chosen = info.name == gpu.adapter.name;
            let software = is_software(&info);
            let limits = adapter.limits();
            text += &format!(
                "{} {} ({:?}, {}){}\n    driver: {} {}\n    textures up to {} pixels a side, buffers up to {} MiB\n",
                if chosen { "*" } else { " " },
                info.name,
                info.backend,
                format!("{:?}", info.device_type).to_lowercase(),
                if software { ": a software rasteriser; right, but slow" } else { "" },
                info.driver,
                info.driver_info,
                limits.max_texture_dimension_2d,
                limits.max_storage_buffer_binding_size >> 20,
            );
            facts.push(json!({
                "name": info.name,
                "backend": format!("{:?}", info.backend),
                "type": format!("{:?}", info.device_type),
                "driver": info.driver,
                "driver_info": info.driver_info,
                "software": software,
                "chosen": chosen,
                "max_texture": limits.max_texture_dimension_2d,
                "max_storage_binding": limits.max_storage_buffer_binding_size,
                "timestamps": adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
            }));
        }
        let shaders = Shaders::usual_folder();
        let cache = options.cache_folder();
        let from = shaders.as_ref().map_or("the program itself".into(), |folder| folder.display().to_string());
        text += &format!("shaders come from {from}\nbakes are kept in {}\n", cache.display());
        Ok(Answer::new(text, json!({ "adapters": facts, "shaders": from, "cache": cache.display().to_string() })))
    }
}
