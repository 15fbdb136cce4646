fn main(){ let p=std::env::args().nth(1).unwrap(); let t=std::time::Instant::now();
 let s=pathspace_scenes::load(std::path::Path::new(&p),&[]).unwrap_or_else(|e|{println!("{e}");std::process::exit(2)});
 println!("{:.2}s {:?} {:?}", t.elapsed().as_secs_f64(), s.warnings, s.description.shapes.iter().map(|s|match &s.geometry{pathspace_core::description::ShapeGeometry::Mesh(m)=>(m.positions.len(),m.triangles.len()),_=>(0,0)}).collect::<Vec<_>>()); }
